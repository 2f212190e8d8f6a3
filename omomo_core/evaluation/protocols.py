"""The questions a generator is asked about a clip, and its answers measured.

Palms given or guessed, each with and without the person's pose in the first frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch

from omomo_core.baselines.opposed_palms import opposed_palms
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.evaluation.clips import RealClip
from omomo_core.evaluation.metrics import (
    contact_scores,
    foot_measures,
    joint_errors,
    root_orientation_error,
)
from omomo_core.evaluation.touch import Touching
from omomo_core.generation.generator import generate
from omomo_core.generation.known import Known, Pose
from omomo_core.generation.result import GenerationOptions, Progress, Stages
from omomo_core.generation.take import prepare
from omomo_core.motion import FPS, HandMotion, HumanMotion

PROTOCOLS = (
    "gt_palms",
    "gt_palms_first_frame",
    "predicted_palms",
    "predicted_palms_first_frame",
)
BASELINE = "baseline_opposed_palms"
BodyChoice = Literal["person", "shipped"]
"""Whose bones generated people have: the recorded person's, as the paper gives the shape, or our
body's at its own stature."""

Row = dict[str, float]


@dataclass(frozen=True)
class Answer:
    """One protocol on one clip."""

    one: Row
    """What the product shows: the sample it chooses."""
    best: Row
    """The sample with the least MPJPE, every figure of it; and the best HandJPE of any sample."""
    mean: Row
    """What one sample without a choice is expected to give."""


def ask(
    clip: RealClip,
    protocol: str,
    stages: Stages,
    options: GenerationOptions,
    body: BodyModel,
    progress: Progress,
) -> Answer:
    """Generate people for a clip under a protocol and measure them.

    Args:
        clip: the object and the truth.
        protocol: one of PROTOCOLS.
        stages: the networks.
        options: samples (K) and seed.
        body: whose bones the generated people get.
        progress: told what is being done.
    """
    touching = Touching(clip.motion)
    held = touching.palms(clip.joints[:, 22:])
    known = Known(
        hands=HandMotion(clip.joints[:, 22:], held.astype(float)) if "gt_" in protocol else None,
        first_frame=Pose(clip.root[0], clip.rotations[0]) if "first_frame" in protocol else None,
    )
    people = generate(clip.motion, body, stages, options, progress, known)
    rows = [measure(human, clip, touching) for human in people.motions]
    best = int(np.argmin([row["mpjpe_cm"] for row in rows]))
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    for k in {people.chosen, best}:
        rows[k] |= touching.penetration(people.motions[k], body)
    hand = min(row["hand_jpe_cm"] for row in rows)
    return Answer(rows[people.chosen], {**rows[best], "hand_jpe_best_cm": hand}, mean)


def measure(human: HumanMotion, clip: RealClip, touching: Touching) -> Row:
    """Every figure of one person that needs no surface of theirs."""
    found, true = (touching.palms(joints[:, 22:]) for joints in (human.joints, clip.joints))
    return {
        **joint_errors(human.joints, clip.joints),
        "o_root": root_orientation_error(human.rotations[:, 0], clip.rotations[:, 0]),
        **contact_scores(found, true),
        **foot_measures(human.joints),
    }


def own_values(clip: RealClip, touching: Touching) -> Row:
    """What the recorded person gives where nothing is compared."""
    held = touching.palms(clip.joints[:, 22:])
    return {
        **foot_measures(clip.joints),
        **touching.penetration(recorded_person(clip, clip.body), clip.body),
        "contact_share": float(held.any(axis=1).mean()),
        "left_contact_share": float(held[:, 0].mean()),
        "right_contact_share": float(held[:, 1].mean()),
        "seconds": len(held) / FPS,
    }


def recorded_person(clip: RealClip, body: BodyModel) -> HumanMotion:
    """The truth on a body, in the type that the generator returns."""
    root, R = torch.from_numpy(clip.root), torch.from_numpy(clip.rotations)
    frames = len(root)
    return HumanMotion(
        root=clip.root,
        rotations=clip.rotations,
        fingers=body.relaxed_fingers.expand(frames, 30, 3, 3).double().numpy(),
        joints=forward_kinematics(body, root, R).numpy(),
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.zeros((frames, 4)),
    )


def unlearned(clip: RealClip, touching: Touching, samples: int, seed: int) -> tuple[Row, Row]:
    """Opposed palms: figures of one random guess on average, and of the best of K by HandJPE."""
    guesses = opposed_palms(prepare(clip.motion), samples, np.random.default_rng(seed))
    true = clip.joints[:, 22:]
    held = touching.palms(true)
    rows = [
        {
            "hand_jpe_cm": 100 * float(np.linalg.norm(g.palms - true, axis=-1).mean()),
            **contact_scores(g.contact > 0.5, held),
        }
        for g in guesses
    ]
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    return mean, min(rows, key=lambda row: row["hand_jpe_cm"])


def average(rows: Sequence[Mapping[str, float]]) -> Row:
    """Plain mean over clips, as published; contact also over the frames of all clips together.

    In the mean a clip in which nobody ever touches counts as a failure, whatever is generated.
    """
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    if "contact_hit_frames" in mean:
        hit, found, true = (mean[f"contact_{name}_frames"] for name in ("hit", "found", "true"))
        mean["contact_precision_all_frames"] = hit / max(found, 1e-9)
        mean["contact_recall_all_frames"] = hit / max(true, 1e-9)
        mean["contact_f1_all_frames"] = 2 * hit / max(found + true, 1e-9)
    return mean
