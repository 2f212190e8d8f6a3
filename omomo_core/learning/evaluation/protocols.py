"""The questions a generator is asked about a clip, and an answer without learning beside it.

Palms given or guessed, each with and without the person's pose in the first frame; guessed, also with the
place on which the person stood at first.
"""

from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.contact.static_stability import must_be_held
from omomo_core.generation.conditioning import Conditioning, Pose
from omomo_core.generation.generation_options import GenerationOptions, Progress
from omomo_core.generation.generator import generate
from omomo_core.geometry.object_features import ObjectFeatures, object_features
from omomo_core.geometry.transforms import apply
from omomo_core.learning.evaluation.metrics import (
    Row,
    contact_scores,
    foot_measures,
    swing_measures,
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
)
BASELINE = "baseline_opposed_palms"
BodyChoice = Literal["person", "shipped"]
"""Whose bones generated people have: the recorded person's, as the paper gives the shape, or our
body's at its own stature."""


def ask(
    truth: Truth,
    protocol: str,
    stages: Stages,
    options: GenerationOptions,
    body: BodyModel,
    progress: Progress,
) -> MeasuredSamples:
    """Generate people for a clip under a protocol and measure them.

    Args:
        truth: the object and the person who moved it.
        protocol: one of PROTOCOLS.
        stages: the networks.
        options: samples (K) and seed.
        body: whose bones the generated people get.
        progress: called with the step and the fraction done.
    """
    clip = truth.clip
    known = Conditioning(
        hands=HandMotion(clip.joints[:, 22:], truth.held[0].astype(float))
        if "gt_" in protocol
        else None,
        start_pose=Pose(clip.root[0], clip.rotations[0]) if "first_frame" in protocol else None,
        start_position=clip.root[0, :2] if "stood" in protocol else None,
    )
    people = generate(clip.motion, body, stages, options, progress, known)
    return truth.answer(people.motions, people.chosen, body)


def own_values(truth: Truth) -> Row:
    """What the recorded person gives where nothing is compared.

    ``must_hold_contact_...`` are the scores of an answer without learning: some hand touches exactly
    while the object's motion demands it.
    """
    clip, held = truth.clip, truth.held[0]
    while_moved = contact_scores(np.repeat(truth.must_hold[:, None], 2, axis=1), held)
    return {
        **foot_measures(clip.joints),
        **swing_measures(clip.joints),
        **truth.touching.penetration(recorded_person(clip, clip.body), clip.body),
        **truth.touching.collisions(truth.vertices),
        "contact_share": float(held.any(axis=1).mean()),
        "left_contact_share": float(held[:, 0].mean()),
        "right_contact_share": float(held[:, 1].mean()),
        **{f"must_hold_{k}": v for k, v in while_moved.items() if k.startswith("contact_")},
        "seconds": len(held) / FPS,
    }


def unlearned(truth: Truth, samples: int, seed: int) -> tuple[Row, Row]:
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
    return mean, min(rows, key=lambda row: row["hand_jpe_cm"])
