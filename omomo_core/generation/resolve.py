"""Contacts corrected by hand: a person is solved again where a correction touches them.

The palms go to their new places as generated ones do, with the present motion in the place of the sample.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.obstacle import Scanned
from omomo_core.contact.anchor import anchored
from omomo_core.contact.segment import Segment, Span, follow
from omomo_core.generation.decoding import balance, exact_people
from omomo_core.generation.object_clip import Scene, Thing
from omomo_core.generation.person import Person, joined, stretch
from omomo_core.generation.solving.bodies import solve_bodies
from omomo_core.generation.solving.wrists import facing
from omomo_core.generation.wish import Wish
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.runs import runs
from omomo_core.motion import HandMotion, HumanMotion

AROUND = 20
"""Frames before and after a changed contact in which the body goes over to what stays as it is."""
SAME = 1e-4
"""Metres: anchors that are no farther apart are the same."""


def changed(before: Sequence[Segment], after: Sequence[Span]) -> tuple[Span, ...]:
    """Contacts of either that are not in the other; one without an anchor is always new."""
    gone = [s for s in before if not _among(s, after)]
    return (*gone, *(s for s in after if not _among(s, before)))


def resolve(
    person: Person, edited: Sequence[Span], scene: Scene, thing: Thing, body: BodyModel
) -> Person:
    """Give a person other contacts.

    Args:
        person: as they move now, with their present contacts.
        edited: what each hand is to hold; where no anchor is given, at the place of the surface
            that is nearest to the present palm. Those of one hand do not overlap.
        scene: where the object is in the same frames, metres.
        thing: the object.
        body: the person's bones.

    Returns:
        The person with these contacts. Frames that are AROUND or more from every contact that is
        not in both are as they were, bit for bit.
    """
    T = scene.take.motion.T_world_object
    now = HandMotion(person.human.joints[:, 22:], person.human.hand_contact)
    kept = [s for s in person.segments if _among(s, edited)]
    given = [s for s in edited if not _among(s, person.segments)]
    fresh = anchored(given, now, thing.surface, T)
    segments = tuple(sorted((*kept, *fresh), key=lambda s: (s.start, s.hand)))
    free = _free(changed(person.segments, segments), len(T))
    hands = follow(segments, now, T)
    wish = _wish(person.human, hands, fresh, free, scene, thing)
    for start, stop in runs(free > 0):
        new = _solved(person, hands, wish, free, slice(start, stop), body, thing.barrier)
        person = joined([stretch(person, 0, start), new, stretch(person, stop, len(T))])
    return replace(person, segments=segments)


def _among(one: Span, others: Sequence[Span]) -> bool:
    return any(_same(one, other) for other in others)


def _same(a: Span, b: Span) -> bool:
    if not (isinstance(a, Segment) and isinstance(b, Segment)):
        return False
    times = (a.hand, a.start, a.stop) == (b.hand, b.start, b.stop)
    return times and bool(np.linalg.norm(a.anchor - b.anchor) <= SAME)


def _free(contacts: Sequence[Span], frames: int) -> Float[np.ndarray, " frames"]:
    """1 within the contacts, smoothly to 0 over AROUND frames on both sides."""
    t, near = np.arange(frames), np.zeros(frames)
    for s in contacts:
        away = np.maximum(s.start - t, t - (s.stop - 1))
        near = np.maximum(near, 1 - away / AROUND)
    return min_jerk(near)


def _wish(
    human: HumanMotion,
    hands: HandMotion,
    fresh: Sequence[Segment],
    free: Float[np.ndarray, " frames"],
    scene: Scene,
    thing: Thing,
) -> Wish:
    """What is asked for in all frames; away from the changed contacts, what is there."""
    T, present = scene.take.motion.T_world_object, human.joints[:, 22:]
    wrists = facing(_tensor(human.rotations[:, WRISTS]), fresh, thing.surface, T)
    return Wish(
        palms=_tensor(present + free[:, None, None] * (hands.palms - present))[None],
        hold=_tensor(hands.contact)[None],
        R_world_wrist=wrists[None],
        T_world_object=T,
        barrier=thing.barrier,
        balance=balance(scene),
    )


def _solved(
    person: Person,
    hands: HandMotion,
    wish: Wish,
    free: Float[np.ndarray, " frames"],
    rows: slice,
    body: BodyModel,
    barrier: Scanned,
) -> Person:
    """One stretch of the person as wished for."""
    part = stretch(person, rows.start, rows.stop)
    wish = replace(
        wish,
        palms=wish.palms[:, rows],
        hold=wish.hold[:, rows],
        R_world_wrist=wish.R_world_wrist[:, rows],
        T_world_object=wish.T_world_object[rows],
        balance=wish.balance[rows],
    )
    root, R, feet = (
        _tensor(x)[None] for x in (part.human.root, part.human.rotations, part.human.foot_contact)
    )
    solved = solve_bodies(body, root, R, feet, wish, free=_tensor(free[rows]))
    held = HandMotion(hands.palms[rows], hands.contact[rows])
    planted = part.human.foot_contact
    T, segments = wish.T_world_object, [part.segments]
    return exact_people(body, solved, planted[None], [held], segments, T, barrier)[0]


def _tensor(x: np.ndarray) -> Tensor:
    return torch.from_numpy(x).float()
