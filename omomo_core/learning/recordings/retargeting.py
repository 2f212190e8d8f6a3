"""Recorded motion on our skeleton, and the stretches of it that people could be trained on."""

from collections import Counter
from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import sole_points
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.calibration import Corrections
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import Grounded, ground
from omomo_core.learning.recordings.joint_angles import SIDES, elbow
from omomo_core.learning.recordings.mocap import SourceMotion, leg_length
from omomo_core.learning.recordings.smpl import RecordedMotion
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS, joint

SHORTEST = round(0.8 * FPS)
_STEP_HEIGHT = 0.09
"""The level stood on may differ this much from the clip's usual one, metres; more is climbing."""
_DEEPEST_SOLE = -0.08
_LOWEST_PELVIS = 0.22
_LOWEST_HEAD = 0.45
"""Metres; lower means lying, rolling or a handstand, which nobody does while carrying."""
WORST_SKATING = 0.3
_ELBOW = (-15.0, 165.0)
"""Degrees of bending: beyond, the recording is broken."""
_EDGE = round(0.1 * FPS)
"""Frames also dropped around a bad one."""


def mocap_clips(
    motion: SourceMotion,
    corrections: Corrections,
    body: BodyModel,
    dropped: Counter[str] | None = None,
) -> Iterator[Clip]:
    """Yield the stretches of one recording in which the actor stands or moves on one level floor.

    Args:
        motion: a recording.
        corrections: of its skeleton, from `calibrate`.
        body: whose proportions the clips get.
        dropped: counts recordings that skate (``skating``) or have no good stretch (``no-floor``).
    """
    return standing_clips(retargeted(motion, corrections, body), body, dropped)


def retargeted(motion: SourceMotion, corrections: Corrections, body: BodyModel) -> RecordedMotion:
    """A recording on our skeleton, with its name, source and licence."""
    root, rotations = retarget(motion, corrections, body)
    return RecordedMotion(motion.name, motion.skeleton.name, motion.licence, root, rotations)


def standing_clips(
    performance: RecordedMotion, body: BodyModel, dropped: Counter[str] | None = None
) -> Iterator[Clip]:
    """Yield clips as `mocap_clips` does, from motion that is already on our skeleton."""
    grounded = ground(body, performance.root, performance.rotations)
    reason = "skating" if grounded.skating > WORST_SKATING else "no-floor"
    stretches = [] if reason == "skating" else runs(usable_frames(body, grounded))
    stretches = [(a, b) for a, b in stretches if b - a >= SHORTEST]
    if not stretches and dropped is not None:
        dropped[reason] += 1
    name = performance.name
    for k, (first, last) in enumerate(stretches):
        part = slice(first, last)
        yield Clip(
            name=name if len(stretches) == 1 else f"{name}#{k}",
            source=performance.source,
            licence=performance.licence,
            root=grounded.root[part],
            rotations=grounded.rotations[part],
            hand_contact=np.zeros((last - first, 2)),
            foot_contact=grounded.foot_contact[part],
            object_motion=None,
        )


def usable_frames(body: BodyModel, grounded: Grounded) -> Bool[np.ndarray, " frames"]:
    """Frames in which somebody stands or moves on one level floor, with sound elbows."""
    joints = joints_of(body, grounded.root, grounded.rotations)
    soles = sole_points(body, grounded.root, grounded.rotations)
    bad = np.abs(grounded.level - np.median(grounded.level)) > _STEP_HEIGHT
    bad |= soles[..., 2].min(axis=1) < _DEEPEST_SOLE
    bad |= joints[:, 0, 2] < _LOWEST_PELVIS
    bad |= joints[:, joint("head"), 2] < _LOWEST_HEAD
    for side in SIDES:
        flexion = elbow(grounded.rotations, side).flexion
        bad |= (flexion < _ELBOW[0]) | (flexion > _ELBOW[1])
    spread = np.convolve(bad, np.ones(2 * _EDGE + 1), mode="same") > 0
    return ~spread


def retarget(
    motion: SourceMotion, corrections: Corrections, body: BodyModel
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Return a recorded motion on our skeleton: rotations carried over, the root scaled by leg length.

    Args:
        motion: a recording.
        corrections: of its skeleton, from `calibrate`.
        body: whose proportions to fit.

    Returns:
        Root (world, metres, not yet placed on the floor) and global R_world_joint.
    """
    rotations = np.stack([_turned(motion, corrections, name) for name in BODY_JOINTS], axis=1)
    rest = body.rest_joints.double().numpy()
    points = motion.skeleton.points
    hips = (motion.position(points["left_hip"]) + motion.position(points["right_hip"])) / 2
    pelvis_to_hips = (rest[joint("left_hip")] + rest[joint("right_hip")]) / 2 - rest[0]
    root = hips * leg_scale(motion, body) - rotations[:, 0] @ pelvis_to_hips
    return root, rotations


def leg_scale(motion: SourceMotion, body: BodyModel) -> float:
    """Length of our legs (thigh and shin) to that of the recording's."""
    rest = body.rest_joints.double().numpy()
    ours = sum(
        float(np.linalg.norm(rest[joint(f"left_{b}")] - rest[joint(f"left_{a}")]))
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    )
    return ours / leg_length(motion)


def _turned(
    motion: SourceMotion, corrections: Corrections, name: str
) -> Float[np.ndarray, "frames 3 3"]:
    a, b, weight = motion.skeleton.drivers[name]
    R = motion.rotation(a) @ corrections[name]
    if weight == 0.0:
        return R
    towards = np.swapaxes(R, -1, -2) @ motion.rotation(b) @ corrections[name]
    part = Rotation.from_rotvec(Rotation.from_matrix(towards).as_rotvec() * weight)
    return R @ part.as_matrix()
