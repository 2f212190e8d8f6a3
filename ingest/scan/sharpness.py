"""How sharp pictures are: among their neighbours, and at all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import median_filter

from ingest.scan.types import Grey, Pictures

WIDTH = 640
"""Pixels of the longer side at which pictures are judged."""
_NEIGHBOURS = 15
"""Pictures among which one is sharp or not."""
_BLURRED = 0.45
"""Part of its neighbours' usual sharpness below which a picture is blurred."""
_SOFT = 0.62
"""`blur` above which a picture is not sharp by any measure."""
_FAINT = 0.1
"""Part of the edges across one direction that there are along the other, at least, to judge it by."""
_FLOW = 160
"""Pixels of the longer side at which motion is measured."""


@dataclass(frozen=True)
class Looks:
    """Sharpness and content of the candidate pictures, from reduced copies."""

    candidates: tuple[int, ...]
    """Places of the pictures that could be decoded."""
    sharpness: Float64[np.ndarray, " candidates"]
    """Variance of the Laplacian, as a part of what is usual for their neighbours."""
    blur: Float64[np.ndarray, " candidates"]
    """0 is sharp, 1 is nothing but blur, whatever the neighbours are."""
    path: Float64[np.ndarray, " candidates"]
    """How far the picture has moved since the first one, in sizes of it."""

    @property
    def blurred(self) -> Bool[np.ndarray, " candidates"]:
        """Whether a picture is too blurred to be used."""
        return (self.sharpness < _BLURRED) | (self.blur > _SOFT)


def look(
    pictures: Pictures, candidates: Sequence[int], on_progress: Callable[[float], None]
) -> Looks:
    """See each candidate once, at a reduced size.

    Args:
        pictures: where they are.
        candidates: places in it, rising.
        on_progress: how much is done, 0 to 1.
    """
    seen, laplacian, blurs, moves = list[int](), list[float](), list[float](), list[float]()
    before: Grey | None = None
    for index, grey in pictures.greys(candidates, WIDTH):
        seen.append(index)
        calm = np.asarray(cv2.GaussianBlur(grey, (0, 0), 0.8), np.uint8)
        laplacian.append(float(cv2.Laplacian(calm, cv2.CV_32F).var()))
        blurs.append(blur(calm))
        size = round(grey.shape[1] * _FLOW / WIDTH), round(grey.shape[0] * _FLOW / WIDTH)
        small = np.asarray(cv2.resize(calm, size, interpolation=cv2.INTER_AREA), np.uint8)
        moves.append(0.0 if before is None else _motion(before, small))
        before = small
        on_progress(len(seen) / len(candidates))
    sharp = np.array(laplacian)
    usual = median_filter(sharp, min(_NEIGHBOURS, max(1, len(sharp)))) if len(sharp) else sharp
    return Looks(tuple(seen), sharp / np.maximum(usual, 1e-9), np.array(blurs), np.cumsum(moves))


def blur(grey: Grey) -> float:
    """How little a picture loses when it is blurred more, 0 to 1 (Crete et al. 2007)."""
    picture = grey.astype(np.float32)
    found: list[tuple[float, float]] = []
    for axis, size in ((0, (1, 9)), (1, (9, 1))):
        edges = np.abs(np.diff(picture, axis=axis))
        smoothed = np.abs(np.diff(cv2.blur(picture, size), axis=axis))
        found.append((float(edges.sum()), float(np.maximum(edges - smoothed, 0).sum())))
    # A direction in which there is next to nothing to blur tells nothing.
    least = max(1e-9, _FAINT * max(edges for edges, _ in found))
    return max((1 - lost / edges for edges, lost in found if edges >= least), default=1.0)


def _motion(before: Grey, now: Grey) -> float:
    """Median distance that corners moved, in lengths of the longer side; 1 when none is found."""
    if before.shape != now.shape:
        return 1.0
    corners: Any = cv2.goodFeaturesToTrack(before, 80, 0.01, 4)  # None where there are none
    if corners is None or len(corners) < 8:
        return 1.0
    moved, status, _ = cv2.calcOpticalFlowPyrLK(before, now, corners, np.empty_like(corners))
    found = np.asarray(status).ravel() == 1
    if found.sum() < 8:
        return 1.0
    steps = np.linalg.norm((moved - corners).reshape(-1, 2)[found], axis=1)
    return float(np.median(steps)) / max(now.shape)
