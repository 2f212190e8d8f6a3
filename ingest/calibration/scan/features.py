"""SIFT features as COLMAP finds them, and which of two pictures' features are the same."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8

from ingest.colmap import pycolmap

_RATIO = 0.85
"""Angle to the best match in units of that to the second best."""
_MAX_ANGLE = 0.8
"""rad; what looks more different is no match."""


@dataclass(frozen=True)
class SiftFeatures:
    """SIFT keypoints and descriptors of a picture."""

    pixels: Float64[np.ndarray, "points 2"]
    """Counted as COLMAP does: (0.5, 0.5) is the centre of the first pixel."""
    descriptors: Float32[np.ndarray, "points 128"]
    """Unit vectors."""


@cache
def _extractor() -> pycolmap.FeatureExtractor:
    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    return pycolmap.FeatureExtractor.create(device=pycolmap.Device.cpu)


def find_features(picture: UInt8[np.ndarray, "height width"]) -> SiftFeatures:
    """The features of a grey picture."""
    bitmap = pycolmap.Bitmap.from_array(np.ascontiguousarray(picture))
    keypoints, descriptors = _extractor().extract(bitmap)
    pixels = np.array([(point.x, point.y) for point in keypoints], np.float64).reshape(-1, 2)
    return SiftFeatures(pixels, unit(descriptors.data))


def unit(descriptors: np.ndarray) -> Float32[np.ndarray, "points 128"]:
    """COLMAP's descriptors as unit vectors."""
    numbers = np.asarray(descriptors, np.float32).reshape(-1, 128)
    return numbers / np.maximum(np.linalg.norm(numbers, axis=1, keepdims=True), 1e-6)


def match(
    ours: Float32[np.ndarray, "ours 128"], theirs: Float32[np.ndarray, "theirs 128"]
) -> tuple[Int64[np.ndarray, " matches"], Int64[np.ndarray, " matches"], Float32[np.ndarray, " m"]]:
    """Features that are each other's best match, by far: index in both, and the angle (rad)."""
    if min(len(ours), len(theirs)) < 2:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.float32)
    likeness = ours @ theirs.T
    best = likeness.argmax(axis=1)
    mutual = likeness.argmax(axis=0)[best] == np.arange(len(ours))
    first, second = np.arccos(-np.partition(-likeness, 1, axis=1)[:, :2].clip(-1, 1).T)
    kept = np.flatnonzero(mutual & (first < _RATIO * second) & (first < _MAX_ANGLE))
    return kept, best[kept], first[kept]
