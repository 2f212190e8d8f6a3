"""Recorded motion onto our skeleton: rotations carried over, the root scaled by leg length."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.body.model import BodyModel
from omomo_core.learning.recordings.calibration import Corrections
from omomo_core.learning.recordings.mocap import SourceMotion, leg_length
from omomo_core.skeleton import BODY_JOINTS, joint


def retarget(
    motion: SourceMotion, corrections: Corrections, body: BodyModel
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Root (world, metres, not yet placed on the floor) and global rotations on our skeleton.

    Args:
        motion: a recording.
        corrections: of its skeleton, from `calibrate`.
        body: whose proportions to fit.
    """
    rotations = np.stack([_turned(motion, corrections, name) for name in BODY_JOINTS], axis=1)
    rest = body.rest_joints.double().numpy()
    our_leg = sum(
        float(np.linalg.norm(rest[joint(f"left_{b}")] - rest[joint(f"left_{a}")]))
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    )
    points = motion.skeleton.points
    hips = (motion.position(points["left_hip"]) + motion.position(points["right_hip"])) / 2
    pelvis_to_hips = (rest[joint("left_hip")] + rest[joint("right_hip")]) / 2 - rest[0]
    root = hips * (our_leg / leg_length(motion)) - rotations[:, 0] @ pelvis_to_hips
    return root, rotations


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
