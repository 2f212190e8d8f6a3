"""match_cost: how unlike a picture and its neighbours are, if a pixel lay at one depth or another.

Census codes (Zabih and Woodfill 1994) do not mind what exposure does to a picture; a plane sweep
(Collins 1996) needs no rectified pairs, so neighbours may stand anywhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

_REACH = 2
"""Pixels around each one that its code compares it with: 5 x 5."""
_FINE = 2
"""Neighbours are enlarged so many times, as their codes cannot be interpolated."""
_UNSEEN = 40
"""What a pixel costs where a neighbour does not show it: as much as two of noise."""
_MOST_GREY = 48
Codes = UInt8[np.ndarray, "rows columns 4"]
"""24 comparisons of each pixel with those around it, and its own grey."""


@dataclass(frozen=True)
class Neighbour:
    """Another view, as one view sees it."""

    codes: Codes
    """Of its enlarged picture."""
    matrix: Float64[np.ndarray, "3 3"]
    """Its intrinsics."""
    T_neighbour_view: Float64[np.ndarray, "4 4"]


def fine_codes(grey: UInt8[np.ndarray, "h w"]) -> Codes:
    """Codes of a neighbour, enlarged."""
    large = cv2.resize(grey, None, fx=_FINE, fy=_FINE, interpolation=cv2.INTER_LINEAR)
    return _codes(np.asarray(large, np.uint8), _FINE)


def match_cost(
    grey: UInt8[np.ndarray, "h w"],
    matrix: Float64[np.ndarray, "3 3"],
    neighbours: Sequence[Neighbour],
    depths: Float64[np.ndarray, " depths"],
) -> UInt8[np.ndarray, "h w depths"]:
    """Cost of every depth of every pixel, 0 to HIGHEST.

    It is the mean of the two neighbours that match best: what is hidden from one is often seen by
    another.

    Args:
        grey, matrix: the picture and its intrinsics.
        neighbours: at least one.
        depths: metres along the viewing axis.
    """
    own = _codes(grey, 1)
    back = np.linalg.inv(matrix)
    costs = np.empty((*grey.shape, len(depths)), np.uint8)
    for index, depth in enumerate(depths):
        single = [_one_cost(own, neighbour, back, float(depth)) for neighbour in neighbours]
        best, second = single[0], single[min(1, len(single) - 1)]
        best, second = np.minimum(best, second), np.maximum(best, second)
        for other in single[2:]:
            second = np.minimum(second, np.maximum(best, other))
            best = np.minimum(best, other)
        costs[..., index] = (best + second) >> 1
    return costs


def _codes(grey: UInt8[np.ndarray, "h w"], step: int) -> Codes:
    rim = _REACH * step
    h, w = grey.shape
    around = cv2.copyMakeBorder(grey, rim, rim, rim, rim, cv2.BORDER_REPLICATE)
    codes = np.zeros((h, w, 4), np.uint8)
    places = [(y, x) for y in range(0, 2 * rim + 1, step) for x in range(0, 2 * rim + 1, step)]
    places.remove((rim, rim))
    for bit, (y, x) in enumerate(places):
        darker = (around[y : y + h, x : x + w] < grey).astype(np.uint8)
        codes[..., bit // 8] |= darker << np.uint8(bit % 8)
    # 0 is left for what lies beyond the picture.
    codes[..., 3] = np.maximum(grey, 1)
    return codes


def _one_cost(
    own: Codes, neighbour: Neighbour, back: Float64[np.ndarray, "3 3"], depth: float
) -> UInt8[np.ndarray, "h w"]:
    """Cost for a plane that faces the view."""
    T = neighbour.T_neighbour_view
    plane = T[:3, :3].copy()
    plane[:, 2] += T[:3, 3] / depth
    enlarged = np.array([[_FINE, 0, (_FINE - 1) / 2], [0, _FINE, (_FINE - 1) / 2], [0, 0, 1]])
    seen = cv2.warpPerspective(
        neighbour.codes,
        enlarged @ neighbour.matrix @ plane @ back,
        (own.shape[1], own.shape[0]),
        flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(0, 0, 0, 0),
    )
    # The grey's byte is beyond the 24 bits that are compared.
    differ = (_words(seen) ^ _words(own)) & np.uint32(0xFFFFFF)
    grey = seen[..., 3]
    unlike = np.minimum(cv2.absdiff(np.ascontiguousarray(grey), own[..., 3].copy()), _MOST_GREY)
    cost = (np.bitwise_count(differ) << 1) + (unlike >> 1)
    np.putmask(cost, grey == 0, _UNSEEN)
    return cost


def _words(codes: np.ndarray) -> np.ndarray:
    return codes.view("<u4")[..., 0]
