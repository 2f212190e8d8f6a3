"""Corrected contacts: what they touch is solved again, the rest stays to the last bit."""

from dataclasses import fields, replace

import numpy as np
import pytest

from omomo_core.body.model import load_body
from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.generation.conditioning import Conditioning
from omomo_core.generation.generation_config import CORRECTION
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person
from omomo_core.generation.resolve_contacts import changed, resolve
from omomo_core.motion import HumanMotion
from omomo_core.weights.load import load_stages
from tests.core.test_generation import carried

BODY = load_body()
FRAMES = 170
MOTION = carried(FRAMES)
OBJECT_MODEL = ObjectModel(MOTION.mesh, scale=1.0)
LEFT, FIRST, SECOND = range(3)


@pytest.fixture(scope="module")
def clip() -> ObjectClip:
    return OBJECT_MODEL.clip(MOTION.T_world_object)


@pytest.fixture(scope="module")
def person() -> Person:
    """The left hand holds all the time, the right one twice."""
    contacts = (ContactSpan(0, 0, FRAMES), ContactSpan(1, 25, 60), ContactSpan(1, 110, 150))
    options = GenerationOptions(samples=1, steps=4)
    known = Conditioning(contacts=contacts)
    made = generate(MOTION, BODY, load_stages(), options, lambda name, done: None, known)
    return made.people[0]


def differing(a: Person, b: Person) -> np.ndarray:
    """Frames in which anything of the body or of what is told of it differs."""
    pairs = [(getattr(a.human, f.name), getattr(b.human, f.name)) for f in fields(HumanMotion)]
    pairs += [(a.miss, b.miss), (a.depth, b.depth)]
    unequal = [(x != y).reshape(FRAMES, -1).any(axis=1) for x, y in pairs]
    return np.flatnonzero(np.any(unequal, axis=0))


def off(person: Person, segment: ContactSegment) -> float:
    """How far the palm is from the segment's anchor at most, metres."""
    T = MOTION.T_world_object[segment.start : segment.stop]
    place = T[:, :3, :3] @ segment.anchor + T[:, :3, 3]
    palm = person.human.joints[segment.start : segment.stop, 22 + segment.hand]
    return float(np.linalg.norm(palm - place, axis=1).max())


def test_contacts_that_are_the_same_change_nothing(person: Person, clip: ObjectClip):
    again = resolve(person, person.segments, clip, OBJECT_MODEL, BODY)
    assert differing(person, again).size == 0
    assert again.segments == person.segments


def test_a_palm_goes_to_its_new_place_and_other_frames_stay(person: Person, clip: ObjectClip):
    old = person.segments[FIRST]
    moved = replace(old, anchor=old.anchor - 0.1 * np.sign(old.anchor[0]) * np.eye(3)[0])
    new = resolve(
        person, (*person.segments[:FIRST], moved, person.segments[SECOND]), clip, OBJECT_MODEL, BODY
    )
    assert off(new, moved) < 0.01
    assert off(new, replace(person.segments[LEFT], stop=80)) < 0.01
    touched = differing(person, new)
    assert touched.min() > old.start - CORRECTION.blend
    assert touched.max() < old.stop - 1 + CORRECTION.blend
    assert new.segments[FIRST] == moved
    # The body goes over to what stays without a jump.
    step = np.linalg.norm(np.diff(new.human.joints, axis=0), axis=-1).max(axis=1)
    usual = np.linalg.norm(np.diff(person.human.joints, axis=0), axis=-1).max(axis=1)
    seams = [old.start - CORRECTION.blend, old.stop - 2 + CORRECTION.blend]
    assert (step - usual)[seams].max() < 0.01


def test_only_the_stretches_around_changes_are_solved(person: Person, clip: ObjectClip):
    first, second = (replace(s, stop=s.stop - 8) for s in person.segments[FIRST:])
    new = resolve(person, (person.segments[LEFT], first, second), clip, OBJECT_MODEL, BODY)
    touched = differing(person, new)
    assert not set(touched) & set(range(60 - 1 + CORRECTION.blend, 110 - CORRECTION.blend + 1))
    assert touched.min() < 60 < 110 < touched.max()


def test_a_hand_lets_go_where_its_contact_is_taken_out(person: Person, clip: ObjectClip):
    new = resolve(
        person, (person.segments[LEFT], person.segments[SECOND]), clip, OBJECT_MODEL, BODY
    )
    assert (new.human.hand_contact[:100, 1] == 0).all()
    assert (new.human.hand_contact[:, 0] == person.human.hand_contact[:, 0]).all()
    assert (new.miss[:100, 1] == 0).all()
    assert len(new.segments) == 2
    none = resolve(person, (), clip, OBJECT_MODEL, BODY)
    assert none.segments == ()
    assert (none.human.hand_contact == 0).all()


def test_a_contact_without_an_anchor_is_where_the_palm_is(person: Person, clip: ObjectClip):
    old = person.segments[FIRST]
    edited = (person.segments[LEFT], ContactSpan(1, 30, 55), person.segments[SECOND])
    new = resolve(person, edited, clip, OBJECT_MODEL, BODY)
    assert np.linalg.norm(new.segments[FIRST].anchor - old.anchor) < 0.02
    assert off(new, new.segments[FIRST]) < 0.01
    assert (new.human.hand_contact[30:55, 1] == 1).all()


def test_what_cannot_be_reached_is_said_in_the_frames_where_it_is(person: Person, clip: ObjectClip):
    far = ContactSegment(1, 30, 55, np.array([0.0, 0.0, 2.5]))
    new = resolve(
        person, (person.segments[LEFT], far, person.segments[SECOND]), clip, OBJECT_MODEL, BODY
    )
    assert new.miss[30:55, 1].min() > 0.3
    assert new.miss[70:, 1].max() < 0.01


def test_changes_are_found_in_either_direction():
    at = np.array([0.1, 0.2, 0.3])
    a, b = ContactSegment(0, 5, 9, at), ContactSegment(1, 5, 9, at)
    near, away = replace(a, anchor=at + 3e-5), replace(a, anchor=at + 3e-4)
    assert changed((a, b), (b, near)) == ()
    assert changed((a, b), (b,)) == (a,)
    assert changed((b,), (b, a)) == (a,)
    assert changed((a,), (away,)) == (a, away)
    assert changed((a,), (replace(a, stop=8),)) == (a, replace(a, stop=8))
    assert changed((a,), (ContactSpan(0, 5, 9),)) == (a, ContactSpan(0, 5, 9))
