"""Contacts corrected by hand: a person is solved again in the frames around each correction.

The palms go to their new anchors as generated ones do, with the present motion in place of the sample.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.contact.segment import ContactSegment, ContactSpan, anchor_spans, follow_anchors
from omomo_core.generation.collision.approach import lead_around
from omomo_core.generation.decoding import (
    arms_follow,
    assemble_people,
    balance_weight,
    face_palms,
    finish_arms,
)
from omomo_core.generation.generation_config import CORRECTION
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person, join, stretch
from omomo_core.generation.solving.bodies import solve_bodies
from omomo_core.geometry.runs import min_jerk, runs
from omomo_core.motion import HandMotion, HumanMotion


def changed(
    before: Sequence[ContactSegment], after: Sequence[ContactSpan]
) -> tuple[ContactSpan, ...]:
    """Return the contacts that only one of the two has; a contact without an anchor is always new."""
    gone = [s for s in before if not _among(s, after)]
    return (*gone, *(s for s in after if not _among(s, before)))


def resolve(
    person: Person,
    edited: Sequence[ContactSpan],
    clip: ObjectClip,
    object_model: ObjectModel,
    body: BodyModel,
) -> Person:
    """Return the person with other contacts, solved again around those that have changed.

    Args:
        person: as they move now, with their present contacts.
        edited: what each hand is to hold; where no anchor is given, at the place of the surface
            that is nearest to the present palm. Those of one hand do not overlap.
        clip: where the object is in the same frames, metres.
        object_model: the object.
        body: the person's bones.

    Returns:
        The person with these contacts. Frames that are `CORRECTION.blend` or more from every contact that is
        not in both are as they were, bit for bit.
    """
    T = clip.take.motion.T_world_object
    now = HandMotion(person.human.joints[:, 22:], person.human.hand_contact)
    kept = [s for s in person.segments if _among(s, edited)]
    given = [s for s in edited if not _among(s, person.segments)]
    fresh = anchor_spans(given, now, object_model.surface, T)
    segments = tuple(sorted((*kept, *fresh), key=lambda s: (s.start, s.hand)))
    free = _free(changed(person.segments, segments), len(T))
    straight = follow_anchors(segments, now, T, object_model.surface)
    hands = lead_around([straight], [segments], clip, object_model)[0]
    targets = _interaction_targets(person.human, hands, fresh, free, clip, object_model)
    for start, stop in runs(free > 0):
        new = _solved(person, hands, targets, free, slice(start, stop), body, object_model.obstacle)
        person = join([stretch(person, 0, start), new, stretch(person, stop, len(T))])
    return replace(person, segments=segments)


def _among(one: ContactSpan, others: Sequence[ContactSpan]) -> bool:
    return any(_same(one, other) for other in others)


def _same(a: ContactSpan, b: ContactSpan) -> bool:
    if not (isinstance(a, ContactSegment) and isinstance(b, ContactSegment)):
        return False
    times = (a.hand, a.start, a.stop) == (b.hand, b.start, b.stop)
    return times and bool(np.linalg.norm(a.anchor - b.anchor) <= CORRECTION.same_anchor)


def _free(contacts: Sequence[ContactSpan], frames: int) -> Float[np.ndarray, " frames"]:
    """Return 1 within the contacts, falling smoothly to 0 over `CORRECTION.blend` frames on both sides."""
    t, near = np.arange(frames), np.zeros(frames)
    for s in contacts:
        away = np.maximum(s.start - t, t - (s.stop - 1))
        near = np.maximum(near, 1 - away / CORRECTION.blend)
    return min_jerk(near)


def _interaction_targets(
    human: HumanMotion,
    hands: HandMotion,
    fresh: Sequence[ContactSegment],
    free: Float[np.ndarray, " frames"],
    clip: ObjectClip,
    object_model: ObjectModel,
) -> InteractionTargets:
    """Return the targets of all frames; away from the changed contacts they are the present motion."""
    T, present = clip.take.motion.T_world_object, human.joints[:, 22:]
    wrists = face_palms(_tensor(human.rotations[:, WRISTS]), fresh, object_model.surface, T)
    return InteractionTargets(
        palms=_tensor(present + free[:, None, None] * (hands.palms - present))[None],
        hold=_tensor(arms_follow(hands.contact))[None],
        R_world_wrist=wrists[None],
        T_world_object=T,
        obstacle=object_model.obstacle,
        balance=balance_weight(clip),
    )


def _solved(
    person: Person,
    hands: HandMotion,
    targets: InteractionTargets,
    free: Float[np.ndarray, " frames"],
    rows: slice,
    body: BodyModel,
    obstacle: MeshObstacle,
) -> Person:
    """Return one stretch of the person, solved for the targets."""
    part = stretch(person, rows.start, rows.stop)
    targets = replace(
        targets,
        palms=targets.palms[:, rows],
        hold=targets.hold[:, rows],
        R_world_wrist=targets.R_world_wrist[:, rows],
        T_world_object=targets.T_world_object[rows],
        balance=targets.balance[rows],
    )
    root, R, feet = (
        _tensor(x)[None] for x in (part.human.root, part.human.rotations, part.human.foot_contact)
    )
    solved = solve_bodies(body, root, R, feet, targets, free=_tensor(free[rows]))
    held = HandMotion(hands.palms[rows], hands.contact[rows])
    T, segments = targets.T_world_object, [part.segments]
    solved = finish_arms(body, solved, targets, [held], segments, _tensor(free[rows]))
    planted = part.human.foot_contact
    return assemble_people(body, solved, planted[None], [held], segments, T, obstacle)[0]


def _tensor(x: np.ndarray) -> Tensor:
    return torch.from_numpy(x).float()
