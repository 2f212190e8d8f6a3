"""The questions a generator is asked about a clip, and an answer without learning beside it.

Palms given or guessed, each with and without the person's pose in the first frame; guessed, also with the
place on which the person stood at first, the place at the end, and the side and hands they hold with.
"""

from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.contact.static_stability import middle_of_hold, must_be_held
from omomo_core.generation.conditioning import Conditioning, PlaceInTime, Pose
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.geometry.object_features import ObjectFeatures, object_features
from omomo_core.geometry.transforms import apply
from omomo_core.learning.evaluation.evaluation_runner import Task
from omomo_core.learning.evaluation.metrics import (
    Row,
    contact_scores,
    foot_measures,
    swing_measures,
    walking_measures,
)
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth, recorded_person
from omomo_core.motion import FPS, HandMotion
from omomo_core.stages.stage import Stages


def opposed_palms(
    take: ObjectFeatures, samples: int, random: np.random.Generator
) -> list[HandMotion]:
    """Return samples of the palms.

    Args:
        take: the object's motion.
        samples: how many guesses.
        random: draws a horizontal direction for each.

    Returns:
        Palms on the surface points farthest along and against the direction as the object lies in
        its first frame; contact where the object moves. While it rests the palms stay there: no
        body without learning says where else they would be.
    """
    held = must_be_held(take).astype(float)
    contact = np.stack([held, held], axis=1)
    return [
        HandMotion(palms=_ends(take, direction), contact=contact)
        for direction in random.uniform(0, 2 * np.pi, samples)
    ]


def _ends(take: ObjectFeatures, direction: float) -> Float[np.ndarray, "frames 2 3"]:
    T = take.motion.T_world_object
    along = take.surface.points @ T[0, :3, :3].T @ [np.cos(direction), np.sin(direction), 0.0]
    ends = take.surface.points[[int(along.argmax()), int(along.argmin())]]
    return apply(T, ends)


PROTOCOLS = (
    "gt_palms",
    "gt_palms_first_frame",
    "predicted_palms",
    "predicted_palms_first_frame",
    "predicted_palms_stood",
    "predicted_palms_stood_ends",
    "predicted_palms_stood_ends_side_hands",
)
FIRST_FRAME = "_first_frame"
"""End of the names of protocols that give the person's first pose."""
BASELINE, RECORDED = "baseline_opposed_palms", "real_clips"
"""What is measured beside the protocols: palms without learning, and the recorded people."""
BodyChoice = Literal["person", "shipped"]
"""Whose bones generated people have: the recorded person's, as the paper gives the shape, or our
body's at its own stature."""


def asked_of(protocol: str) -> tuple[str, bool]:
    """What is given besides the first pose, and whether that is given, as a `Task` names them."""
    return protocol.removesuffix(FIRST_FRAME), protocol.endswith(FIRST_FRAME)


def protocol_of(task: Task) -> str:
    """The protocol of a task."""
    return task.method + FIRST_FRAME * task.first_frame


def ask(
    truth: Truth, task: Task, stages: Stages, options: GenerationOptions, body: BodyModel | None
) -> MeasuredSamples:
    """Generate people for a clip under a protocol and measure them.

    Args:
        truth: the object and the person who moved it.
        task: of one of PROTOCOLS, or of what stands beside them: BASELINE or RECORDED.
        stages: the networks.
        options: samples (K) and seed.
        body: whose bones the generated people get; None takes the recorded person's.
    """
    if task.method == RECORDED:
        return MeasuredSamples(_own_values(truth), {}, {})
    if task.method == BASELINE:
        return _unlearned(truth, options.samples, options.seed)
    clip = truth.clip
    palms = HandMotion(clip.joints[:, 22:], truth.held[0].astype(float))
    middle = middle_of_hold(truth.must_hold)
    known = Conditioning(
        hands=palms if task.method == "gt_palms" else None,
        start_pose=Pose(clip.root[0], clip.rotations[0]) if task.first_frame else None,
        start_position=clip.root[0, :2] if "_stood" in task.method else None,
        end_position=clip.root[-1, :2] if "_ends" in task.method else None,
        side=PlaceInTime(clip.root[middle, :2], middle) if "_side" in task.method else None,
        held_with=truth.hands if "_hands" in task.method else None,
    )
    theirs = body or clip.body
    people = generate(clip.motion, theirs, stages, options, conditioning=known)
    return truth.answer(people.motions, people.chosen, theirs)


def _own_values(truth: Truth) -> Row:
    """What the recorded person gives where nothing is compared.

    ``must_hold_contact_...`` are the scores of an answer without learning: some hand touches exactly
    while the object's motion demands it.
    """
    clip, held = truth.clip, truth.held[0]
    while_moved = contact_scores(np.repeat(truth.must_hold[:, None], 2, axis=1), held)
    return {
        **foot_measures(clip.joints),
        **swing_measures(clip.joints),
        **walking_measures(clip.joints),
        **truth.touching.penetration(recorded_person(clip, clip.body), clip.body),
        **truth.touching.collisions(truth.vertices),
        "contact_share": float(held.any(axis=1).mean()),
        "left_contact_share": float(held[:, 0].mean()),
        "right_contact_share": float(held[:, 1].mean()),
        **{f"must_hold_{k}": v for k, v in while_moved.items() if k.startswith("contact_")},
        "seconds": len(held) / FPS,
    }


def _unlearned(truth: Truth, samples: int, seed: int) -> MeasuredSamples:
    """Opposed palms: figures of one random guess on average, and of the best of K by HandJPE."""
    guesses = opposed_palms(
        object_features(truth.clip.motion), samples, np.random.default_rng(seed)
    )
    true = truth.clip.joints[:, 22:]
    rows = [
        {
            "hand_jpe_cm": 100 * float(np.linalg.norm(g.palms - true, axis=-1).mean()),
            **contact_scores(g.contact > 0.5, truth.held[0]),
        }
        for g in guesses
    ]
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    return MeasuredSamples(mean, min(rows, key=lambda row: row["hand_jpe_cm"]), {})
