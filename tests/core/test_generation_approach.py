"""Hands that come to an object and go from it: around it where the network leads them through it."""

import numpy as np
import pytest
import trimesh

from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.approach import lead_around
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.geometry.runs import min_jerk
from omomo_core.motion import HandMotion, ObjectMesh

FRAMES, HELD, LET_GO = 90, 40, 50
BOX = (0.4, 0.4, 0.3)
SOLID = trimesh.creation.box(BOX)
MODEL = ObjectModel(ObjectMesh(np.array(SOLID.vertices), np.array(SOLID.faces), "box"), 1.0)
FAR_SIDE, NEAR_SIDE = np.array([0.0, 0.229, 0.0]), np.array([0.0, -0.229, 0.0])
WAITING = np.array([0.0, -0.5, 0.05])


def standing_box(height: float = 0.15) -> np.ndarray:
    """Its poses: it stands on the floor, or is at this height."""
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 2, 3] = height
    return T


def reach(anchor: np.ndarray, T: np.ndarray) -> tuple[HandMotion, tuple[ContactSegment, ...]]:
    """A right hand that goes straight to its anchor and back to where it waited."""
    t = np.arange(FRAMES)
    share = min_jerk(1 - np.maximum(np.maximum(HELD - t, t - LET_GO + 1), 0) / 25)
    palms = np.full((FRAMES, 2, 3), 5.0)
    palms[:, 1] = WAITING + share[:, None] * (anchor - WAITING) + T[:, :3, 3]
    contact = np.zeros((FRAMES, 2))
    contact[HELD:LET_GO, 1] = 1
    return HandMotion(palms, contact), (ContactSegment(1, HELD, LET_GO, anchor),)


def led(anchor: np.ndarray, T: np.ndarray, first: int = 0) -> tuple[HandMotion, np.ndarray]:
    """The hand that is led around, and its right palm in the object's frame."""
    hand, segments = reach(anchor, T)
    found = lead_around([hand], [segments], MODEL.clip(T), MODEL, first)[0]
    return found, found.palms[:, 1] - T[:, :3, 3]


def clearance(places: np.ndarray) -> np.ndarray:
    """Distance from the box, metres, negative inside."""
    out = np.abs(places) - np.array(BOX) / 2
    return np.linalg.norm(out.clip(min=0), axis=1) + out.max(axis=1).clip(max=0)


def test_a_hand_that_comes_through_the_box_comes_around_it_and_goes_around_it():
    found, palm = led(FAR_SIDE, standing_box())
    straight = reach(FAR_SIDE, standing_box())[0].palms[:, 1] - standing_box()[:, :3, 3]
    assert clearance(straight).min() < -0.1
    assert clearance(palm).min() > 0.02
    assert palm[HELD:LET_GO] == pytest.approx(straight[HELD:LET_GO])
    assert found.palms[..., 2].min() > 0.028, "not through the floor"
    assert np.linalg.norm(np.diff(palm, axis=0), axis=1).max() < 0.1


def test_a_hand_that_comes_from_its_own_side_is_left_alone():
    T = standing_box()
    found, _ = led(NEAR_SIDE, T)
    np.testing.assert_array_equal(found.palms, reach(NEAR_SIDE, T)[0].palms)


def test_frames_that_are_fixed_stay_and_so_does_the_other_hand():
    T = standing_box(1.0)
    found, _ = led(FAR_SIDE, T, first=LET_GO)
    before = reach(FAR_SIDE, T)[0]
    np.testing.assert_array_equal(found.palms[:LET_GO], before.palms[:LET_GO])
    np.testing.assert_array_equal(found.palms[:, 0], before.palms[:, 0])
    np.testing.assert_array_equal(found.contact, before.contact)


def test_a_hand_that_begins_in_the_box_is_left_as_it_is():
    T = standing_box()
    hand, segments = reach(FAR_SIDE, T)
    hand.palms[:HELD, 1] = T[0, :3, 3]
    found = lead_around([hand], [segments], MODEL.clip(T), MODEL)[0]
    np.testing.assert_array_equal(found.palms[:HELD], hand.palms[:HELD])
