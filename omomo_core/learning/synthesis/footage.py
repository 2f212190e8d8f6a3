"""Which stretches of mocap somebody could move an object in, and where they could stop for it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.clips import Clip
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS

_SHORTEST = round(1.5 * FPS)
_LONGEST_SHARE = 25 * FPS
"""A take counts as if it were at most so long, such that one person does not fill everything."""
_FASTEST = 2.0
_FASTEST_JOINT = 15.0
"""Radians per second; more is a glitch of the recording, or a fight."""
_STRIDE = 0.48
"""Metres between the ankles; in a longer step nobody stops to lift something."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of a mocap clip."""

    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    stops: Float[np.ndarray, " frames"]
    """How well one could stop at a frame: 0 not at all (feet in the air), 1 is standing still."""
    name: str
    licence: str


@dataclass(frozen=True)
class Footage:
    """All usable stretches with the chance of each to be picked."""

    stretches: list[Stretch]
    chances: Float[np.ndarray, " stretches"]


def survey(clips: Sequence[Clip], body: BodyModel) -> Footage:
    """Find the stretches of walking, turning, standing, bending: nothing airborne or wild."""
    stretches: list[Stretch] = []
    for clip in clips:
        joints = joints_of(body, clip.root, clip.rotations)
        stops = _stops(clip, joints)
        for first, last in runs(_calm(clip, joints)):
            if last - first >= _SHORTEST:
                part = slice(first, last)
                name = f"{clip.name}[{first}:{last}]"
                root, rotations = clip.root[part].astype(float), clip.rotations[part].astype(float)
                stretches.append(Stretch(root, rotations, stops[part], name, clip.licence))
    lengths = np.array([min(len(s.root), _LONGEST_SHARE) for s in stretches], float)
    return Footage(stretches, lengths / max(lengths.sum(), 1.0))


def mirrored(stretch: Stretch) -> Stretch:
    """Left and right exchanged."""
    swap = [BODY_JOINTS.index(_other_side(name)) for name in BODY_JOINTS]
    across_world, across_body = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, 1.0])
    return Stretch(
        root=stretch.root @ across_world,
        rotations=across_world @ stretch.rotations[:, swap] @ across_body,
        stops=stretch.stops,
        name=f"{stretch.name} mirrored",
        licence=stretch.licence,
    )


def reversed_in_time(stretch: Stretch) -> Stretch:
    """Walking forward becomes walking backward."""
    return Stretch(
        root=stretch.root[::-1],
        rotations=stretch.rotations[::-1],
        stops=stretch.stops[::-1],
        name=f"{stretch.name} reversed",
        licence=stretch.licence,
    )


def heading(rotations: Float[np.ndarray, "frames 22 3 3"]) -> Float[np.ndarray, " frames"]:
    """Yaw of the pelvis' forward direction about world z, unwrapped, radians."""
    forward = rotations[:, 0, :, 2]
    return np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))


def _other_side(name: str) -> str:
    if name.startswith("left_"):
        return name.replace("left_", "right_")
    return name.replace("right_", "left_")


def _calm(clip: Clip, joints: Float[np.ndarray, "frames 24 3"]) -> Bool[np.ndarray, " frames"]:
    velocity = np.gradient(gaussian_filter1d(clip.root, 2.0, axis=0), 1 / FPS, axis=0)
    turning = np.gradient(gaussian_filter1d(heading(clip.rotations), 2.0), 1 / FPS)
    standing = maximum_filter1d(clip.foot_contact.max(axis=1), 9) > 0
    calm = (np.linalg.norm(velocity[:, :2], axis=-1) < _FASTEST) & (np.abs(velocity[:, 2]) < 0.7)
    upright = (clip.rotations[:, 0, 2, 1] > 0.75) & (clip.rotations[:, 9, 2, 1] > 0.7)
    turns = np.swapaxes(clip.rotations[:-1], -1, -2) @ clip.rotations[1:]
    cosine = (np.trace(turns, axis1=-2, axis2=-1).min(axis=1, initial=3.0) - 1) / 2
    smooth = np.append(cosine > np.cos(_FASTEST_JOINT / FPS), True)
    # Nobody waves the arms about while handling things.
    low = joints[:, 20:22, 2].max(axis=1) < joints[:, 9, 2]
    return (
        low & calm & smooth & standing & upright & (np.abs(turning) < 4.0) & (clip.root[:, 2] > 0.6)
    )


def _stops(clip: Clip, joints: Float[np.ndarray, "frames 24 3"]) -> Float[np.ndarray, " frames"]:
    planted = clip.foot_contact > 0
    both = (planted[:, 0] | planted[:, 2]) & (planted[:, 1] | planted[:, 3])
    stride = np.linalg.norm(joints[:, 7, :2] - joints[:, 8, :2], axis=-1)
    crossed = ((joints[:, 7] - joints[:, 8]) * clip.rotations[:, 0, :, 0]).sum(-1) < 0.06
    velocity = np.gradient(gaussian_filter1d(clip.root, 2.0, axis=0), 1 / FPS, axis=0)
    speed = np.linalg.norm(velocity[:, :2], axis=-1)
    height = clip.root[:, 2] > 0.8
    return np.where(
        both & (stride < _STRIDE) & ~crossed & height, 0.1 + 0.9 * np.exp(-speed / 0.2), 0
    )
