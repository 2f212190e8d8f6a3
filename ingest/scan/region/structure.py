"""standing_at: the box of what stands where the cameras look, told from what stands beside it."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int64

_CELL = 0.04
"""Metres; things in plan nearer to each other than about two of these are one."""
_SPREAD = 0.25
"""Of the way to the cameras: how far from the aim a part still counts as what is aimed at."""
_RIM = 0.2
"""Percent of the points of each end that may be mistakes."""
FEWEST = 20
"""Points: fewer may be anything."""


@dataclass(frozen=True)
class StandingStructure:
    """Box of the structure that stands on the floor at the aim; floor's frame, metres."""

    low: Float64[np.ndarray, "3"]
    high: Float64[np.ndarray, "3"]
    points: int
    beside: float
    """Weight of the second best structure over that of this one; near 1 the choice is ambiguous."""


def standing_at(
    points: Float64[np.ndarray, "points 3"], distance: float
) -> StandingStructure | None:
    """The structure nearest to the floor frame's z axis.

    Parts are joined in plan, not in space: a pole without detail still joins a lamp's shade with its
    foot, and everything stands on the floor.

    Args:
        points: above the floor, in its frame, none farther away than what may be the object.
        distance: median way from the cameras to the aim, metres.

    Returns:
        None when there are too few points.
    """
    if len(points) < FEWEST:
        return None
    parts = _parts(points[:, :2])
    near = np.exp(-((np.linalg.norm(points[:, :2], axis=1) / (_SPREAD * distance)) ** 2))
    weight = np.bincount(parts, weights=near)
    weight[0] = 0.0
    order = np.argsort(-weight)
    mine = points[parts == order[0]]
    if len(mine) < FEWEST:
        return None
    low, high = np.percentile(mine, (_RIM, 100 - _RIM), axis=0)
    other = weight[order[1]] if len(order) > 1 else 0.0
    return StandingStructure(low, high, len(mine), float(other / weight[order[0]]))


def _parts(plan: Float64[np.ndarray, "points 2"]) -> Int64[np.ndarray, " points"]:
    """Number of the connected part that each point belongs to; 0 is a stray one."""
    cells = np.floor(plan / _CELL).astype(int)
    cells -= cells.min(axis=0)
    count = np.zeros(cells.max(axis=0) + 3, int)
    at = (cells[:, 0] + 1, cells[:, 1] + 1)
    np.add.at(count, at, 1)
    # A cell with one point counts where its neighbours have some too.
    crowd = _around(count)
    filled = (count > 1) | ((count > 0) & (crowd > 1))
    # Grown by a cell all around, parts reach each other over a gap of one.
    _, numbers = cv2.connectedComponents((_around(filled.astype(int)) > 0).astype(np.uint8))
    return np.where(filled[at], np.asarray(numbers)[at], 0).astype(np.int64)


def _around(count: Int64[np.ndarray, "x y"]) -> Int64[np.ndarray, "x y"]:
    """Sum of each cell and its eight neighbours."""
    total = np.zeros_like(count)
    padded = np.pad(count, 1)
    for dx in range(3):
        for dy in range(3):
            total += padded[dx : dx + count.shape[0], dy : dy + count.shape[1]]
    return total


def amid(
    points: Float64[np.ndarray, "points 3"], eyes: Float64[np.ndarray, "views 3"], inside: float
) -> Bool[np.ndarray, " points"]:
    """Which points lie between the aim and the cameras: `inside` is the part of the way there.

    Args:
        points, eyes: in the floor's frame, metres.
        inside: 0 to 1.
    """
    ring = np.linalg.norm(eyes[:, :2], axis=1)
    # A camera right above the aim stands in no ring.
    reach = inside * float(np.percentile(ring, 25))
    return np.linalg.norm(points[:, :2], axis=1) < reach
