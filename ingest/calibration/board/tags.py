"""The corners of single markers in one picture."""

from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32, Float64

from ingest.calibration.board.detect import Grey
from ingest.calibration.board.reference import Tags

_SAMPLES = 16
"""Places along a side of a marker at which its edge is looked for."""
_ENDS = 0.12
"""Part of a side at each end that is left out: blur rounds the corners."""
_REACH = 0.45
"""How far across the edge is looked, in cells: half of the black border and of the white around it."""
_STEPS = 21
"""Samples across the edge."""
_ROUNDS = 3


class TagDetector:
    """Finds single markers in pictures."""

    def __init__(self, tags: Tags) -> None:
        self._detector = cv2.aruco.ArucoDetector(tags.codes)
        self._cells = tags.codes.markerSize + 2
        self._number = tags.number

    def find(self, grey: Grey) -> dict[int, Float64[np.ndarray, "4 2"]]:
        """The corners of each marker seen, pixels, in the order of `Tags.corners`.

        A marker whose number is there twice is left out: which is which is not known.
        """
        found: Any = self._detector.detectMarkers(grey)
        corners, numbers = found[0], found[1]
        listed = [] if numbers is None else np.ravel(numbers).tolist()
        return {
            number: _refined(grey, np.asarray(corner, np.float64).reshape(4, 2), self._cells)
            for number, corner in zip(listed, corners, strict=True)
            if listed.count(number) == 1 and self._number in (None, number)
        }


def _refined(
    grey: Grey, corners: Float64[np.ndarray, "4 2"], cells: int
) -> Float64[np.ndarray, "4 2"]:
    """Corners where lines through the edges of the four sides meet.

    OpenCV's own ways make a marker too small by half a pixel to a whole one at each side, or shift it.
    """
    for _ in range(_ROUNDS):
        lines = [_edge(grey, corners[k], corners[(k + 1) % 4], cells) for k in range(4)]
        meets = np.array([np.cross(lines[k - 1], lines[k]) for k in range(4)])
        found = meets[:, :2] / meets[:, 2:]
        side = np.linalg.norm(corners[2] - corners[0]) / 2
        if not np.isfinite(found).all() or np.abs(found - corners).max() > side / cells:
            return corners
        corners = found
    return corners


def _edge(
    grey: Grey, a: Float64[np.ndarray, "2"], b: Float64[np.ndarray, "2"], cells: int
) -> Float64[np.ndarray, "3"]:
    """The line (n, d) with n x + d = 0 along which it turns from black to white between two corners."""
    side = float(np.linalg.norm(b - a))
    # Corners go round with the inside at the right hand, where y points down.
    along = (b - a) / side
    outward = np.array([along[1], -along[0]])
    across = np.linspace(-1, 1, _STEPS) * max(_REACH * side / cells, 1.0)
    starts = a + np.linspace(_ENDS, 1 - _ENDS, _SAMPLES)[:, None] * (b - a)
    profiles = _sampled(grey, starts[:, None] + across[:, None] * outward)
    steps = np.diff(profiles, axis=1).clip(0)
    middles = (across[1:] + across[:-1]) / 2
    weight = steps.sum(axis=1)
    off = steps @ middles / np.maximum(weight, 1e-9)
    points = starts + off[:, None] * outward
    strong = weight > 0.5 * np.median(weight)
    return _line(points[strong & (np.abs(off - np.median(off[strong])) < 1.0)], outward)


def _line(
    points: Float64[np.ndarray, "points 2"], outward: Float64[np.ndarray, "2"]
) -> Float64[np.ndarray, "3"]:
    """The line of least squares through points."""
    if len(points) < 2:
        return np.full(3, np.nan)
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle)[2][-1]
    normal = normal if normal @ outward > 0 else -normal
    return np.array([*normal, -normal @ middle])


def _sampled(
    grey: Grey, places: Float64[np.ndarray, "sides across 2"]
) -> Float32[np.ndarray, "sides across"]:
    """Brightness between pixels."""
    x, y = (np.ascontiguousarray(places[..., k], np.float32) for k in range(2))
    sampled = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, np.float32)
