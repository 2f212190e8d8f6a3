"""Standing poses of the mocap, which a generated walk takes between its steps."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.synthesis.footage import Footage, Stretch, heading, mirrored
from omomo_core.learning.synthesis.walker.gait import Bearing, blend_poses
from omomo_core.skeleton import joint

_STILL = 0.75
_APART = (0.10, 0.36)
_STAGGER = 0.22
_UPRIGHT = 0.94
"""Cosine of the largest lean of the chest."""
_PALMS_OVER_PELVIS = 0.0
_HANGING = 0.85
"""Cosine between the upper arms and straight down: hands are on no hips, and point nowhere."""
_PER_STRETCH = 4
_ANKLES = (joint("left_ankle"), joint("right_ankle"))
_SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
_ELBOWS = (joint("left_elbow"), joint("right_elbow"))
_TOES = (joint("left_foot"), joint("right_foot"))
_PALMS = (22, 23)
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class StandingPoses:
    """Standing poses, each facing world x with the pelvis over the origin."""

    height: Float[np.ndarray, " poses"]
    rotations: Float[np.ndarray, "poses 22 3 3"]
    apart: Float[np.ndarray, "poses 2 2"]
    toe_out: Float[np.ndarray, "poses 2"]


def find_standing(footage: Footage, body: BodyModel) -> StandingPoses:
    """Frames of the mocap in which somebody stands at ease, and their mirror images.

    Raises:
        InputError: ``walker-standing`` when there is none.
    """
    found: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
    for stretch in footage.stretches:
        still = np.flatnonzero(stretch.stops > _STILL)
        if len(still):
            picked = still[np.linspace(0, len(still) - 1, _PER_STRETCH).round().astype(int)]
            for one in (stretch, mirrored(stretch)):
                found += _at_ease(one, np.unique(picked), body)
    if not found:
        raise InputError(
            "walker-standing",
            "Nobody in the mocap stands still with both feet on the floor.",
            fix="Give clips in which somebody stops and stands for a moment.",
        )
    heights, rotations, apart, toe_out = zip(*found, strict=True)
    return StandingPoses(np.array(heights), np.array(rotations), np.array(apart), np.array(toe_out))


def vary_standing_poses(
    rng: np.random.Generator, standing: StandingPoses, changes: list[tuple[int, int]], frames: int
) -> Bearing:
    """Standing poses that change, one after another, during the given stretches of frames."""
    picks = rng.integers(len(standing.height), size=len(changes) + 1)
    share = np.zeros((len(changes), frames))
    for k, (first, last) in enumerate(changes):
        u = ((np.arange(frames) - first) / max(last - first, 1)).clip(0.0, 1.0)
        share[k] = u * u * (3 - 2 * u)
    weight = np.vstack([np.ones(frames), share]) - np.vstack([share, np.zeros(frames)])
    rotations = np.tile(standing.rotations[picks[0]], (frames, 1, 1, 1))
    for k, (first, last) in enumerate(changes):
        rotations[last:] = standing.rotations[picks[k + 1]]
        rotations[first:last] = blend_poses(
            standing.rotations[picks[k]], standing.rotations[picks[k + 1]], share[k, first:last]
        )
    return Bearing(
        height=standing.height[picks] @ weight,
        rotations=rotations,
        apart=np.einsum("kt,kfx->tfx", weight, standing.apart[picks]),
        toe_out=np.einsum("kt,kf->tf", weight, standing.toe_out[picks]),
    )


def _at_ease(
    stretch: Stretch, frames: np.ndarray, body: BodyModel
) -> list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
    yaw = gaussian_filter1d(heading(stretch.rotations), 2.0)[frames]
    back = Rotation.from_rotvec(-yaw[:, None] * _UP).as_matrix()
    rotations = back[:, None] @ stretch.rotations[frames]
    height = stretch.root[frames, 2]
    root = np.stack([0 * height, 0 * height, height], axis=-1)
    joints = joints_of(body, root, rotations)
    ankles = joints[:, list(_ANKLES), :2]
    forward = rotations[:, list(_TOES)][..., 2]
    toe_out = np.arctan2(forward[..., 1], forward[..., 0])
    apart = ankles[:, 0] - ankles[:, 1]
    good = (apart[:, 1] > _APART[0]) & (apart[:, 1] < _APART[1])
    good &= np.abs(apart[:, 0]) < _STAGGER
    good &= (np.abs(toe_out) < 0.7).all(axis=1) & (height > 0.86 * height_of(body))
    good &= rotations[:, joint("spine3"), 2, 1] > _UPRIGHT
    good &= (joints[:, list(_PALMS), 2] < height[:, None] + _PALMS_OVER_PELVIS).all(axis=1)
    upper_arms = joints[:, list(_ELBOWS)] - joints[:, list(_SHOULDERS)]
    hang = -upper_arms[..., 2] / np.linalg.norm(upper_arms, axis=-1)
    good &= (hang > _HANGING).all(axis=1)
    # The feet belong under the body, also where the pose leans on one leg.
    centre = ankles.mean(axis=1, keepdims=True) * 0.5
    return [
        (float(height[k]), rotations[k], ankles[k] - centre[k], toe_out[k])
        for k in np.flatnonzero(good)
    ]


def height_of(body: BodyModel) -> float:
    """Height of the pelvis over the soles when the legs are straight, metres."""
    return float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
