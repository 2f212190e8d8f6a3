"""find_aim: the place that the cameras look at."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.scan.types import View
from omomo_core.errors import InputError

_ROUNDS = 20
_NARROWEST = np.radians(8)
"""Between the widest pair of directions to a camera: a smaller turn says nothing about depth."""
_MISSES = 0.4
"""By which optical axes may miss the aim, in parts of the way to it (median)."""
_FEWEST = 3


@dataclass(frozen=True)
class Aim:
    """Where optical axes meet."""

    point: Float64[np.ndarray, "3"]
    """World, metres."""
    distance: float
    """Median way from the cameras, metres."""
    miss: float
    """Median way by which the axes miss the point, in parts of `distance`."""


def find_aim(views: Sequence[View]) -> Aim:
    """The point nearest to the optical axes, those that look elsewhere counting little.

    Raises:
        InputError: "scan-no-aim" where the axes do not meet, or "scan-no-orbit" where the cameras
            all stand on one side.
    """
    if len(views) < _FEWEST:
        raise _no_aim(f"there are only {len(views)} pictures")
    poses = np.stack([view.T_world_camera for view in views])
    eyes, axes = poses[:, :3, 3], poses[:, :3, 2]
    # One direction gives no depth: its equations would be singular.
    if np.arccos(np.clip(axes @ axes.T, -1, 1)).max() < _NARROWEST:
        raise _no_orbit()
    weights = np.ones(len(eyes))
    point = eyes.mean(axis=0)
    for _ in range(_ROUNDS):
        point = _nearest(eyes, axes, weights)
        misses = _misses(eyes, axes, point)
        weights = 1 / (1 + (misses / max(float(np.median(misses)), 1e-6)) ** 2)
    to_point = point - eyes
    far = np.linalg.norm(to_point, axis=1)
    miss = float(np.median(_misses(eyes, axes, point) / far))
    ahead = np.einsum("ij,ij->i", to_point, axes) > 0
    if miss > _MISSES or ahead.mean() < 1 - _MISSES:
        raise _no_aim(f"their axes miss each other by {miss:.0%} of the way")
    seen_from = to_point / far[:, None]
    if np.arccos(np.clip(seen_from @ seen_from.T, -1, 1)).max() < _NARROWEST:
        raise _no_orbit()
    return Aim(point, float(np.median(far)), miss)


def _nearest(
    eyes: Float64[np.ndarray, "views 3"],
    axes: Float64[np.ndarray, "views 3"],
    weights: Float64[np.ndarray, " views"],
) -> Float64[np.ndarray, "3"]:
    """The point with the least squared distance to lines."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    A = np.einsum("v,vij->ij", weights, across)
    return np.linalg.solve(A, np.einsum("v,vij,vj->i", weights, across, eyes))


def _misses(
    eyes: Float64[np.ndarray, "views 3"],
    axes: Float64[np.ndarray, "views 3"],
    point: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, " views"]:
    """Metres from a point to lines."""
    return np.linalg.norm(np.cross(point - eyes, axes), axis=1)


def _no_aim(why: str) -> InputError:
    return InputError(
        "scan-no-aim",
        f"The object was not found: the cameras do not look at one place ({why}).",
        fix="Walk around the object with it in the middle of the picture, or give the box that it "
        "is in.",
    )


def _no_orbit() -> InputError:
    return InputError(
        "scan-no-orbit",
        "The object was not found: all the pictures are taken from one direction.",
        fix="Walk all around the object while you film it.",
    )
