"""Which views are matched with which, and how far away their planes stand."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64, Int64

from ingest.scan.types import Registered, View

_BEST_ANGLE = np.radians(12)
"""Between the ways to a point: more is more precise, less looks more alike."""
_NARROWEST, _WIDEST = np.radians(3), np.radians(35)
_APART = np.radians(5)
"""Between neighbours, so that what one does not see another may."""
_RIM = 0.5
"""Percent of the sparse points that may be mistakes, at either end."""
_NEARER, _FARTHER = 0.75, 1.3
"""Depths of a view begin and end at so much of its nearest and farthest points."""
_NEAREST = 0.15
"""Metres."""


def neighbours(
    views: Sequence[View], aim: Float64[np.ndarray, "3"], index: int, count: int
) -> list[int]:
    """Up to `count` views that see the aim from well chosen other directions, the best first."""
    away = aim - np.stack([view.T_world_camera[:3, 3] for view in views])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    between = np.arccos(np.clip(away @ away.T, -1.0, 1.0))
    fits = (between[index] > _NARROWEST) & (between[index] < _WIDEST)
    chosen: list[int] = []
    for other in np.argsort(np.abs(between[index] - _BEST_ANGLE)):
        if fits[other] and all(between[other, taken] > _APART for taken in chosen):
            chosen.append(int(other))
        if len(chosen) == count:
            break
    return chosen


def depth_range(view: View, points: Float64[np.ndarray, "points 3"]) -> tuple[float, float]:
    """Nearest and farthest depth that a view may show, metres, from sparse points that it sees."""
    eye, axis = view.T_world_camera[:3, 3], view.T_world_camera[:3, 2]
    near, far = np.percentile((points - eye) @ axis, (_RIM, 100 - _RIM))
    return max(_NEARER * float(near), _NEAREST), _FARTHER * max(float(far), 2 * _NEAREST)


def points_seen(registered: Registered) -> list[Int64[np.ndarray, " seen"]]:
    """Indices of the sparse points that each view shows."""
    return [
        registered.observed[registered.observed[:, 1] == view, 0]
        for view in range(len(registered.views))
    ]
