"""resect: the pose of a camera from points that it sees, some of them mistaken for others."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.colmap import pycolmap
from ingest.uncertainty import skew

_MAX_ERROR = 4.0
"""Pixels of a picture 640 wide."""
_NEAREST = 0.1
"""Metres; what is nearer is not in focus, and a mistake if it is found."""
_MAX_LEVERAGE = 1.0
"""How many of the pose's six numbers may hang on one point."""
_ROUNDS = 10
_FEWEST = 6
_INDEPENDENT = 50
"""Points that err by themselves: their neighbours share the errors of the model's pictures."""


@dataclass(frozen=True)
class Resection:
    """A camera's pose and what it rests on."""

    T_camera_object: Float64[np.ndarray, "4 4"]
    """OpenCV's camera axes."""
    covariance: Float64[np.ndarray, "6 6"]
    """Of `ingest.uncertainty`."""
    inlier: Bool[np.ndarray, " points"]
    rms: float
    """Pixels between the inliers and where the pose puts them."""


def resect(
    pixels: Float64[np.ndarray, "points 2"],
    points: Float64[np.ndarray, "points 3"],
    intrinsics: Float64[np.ndarray, "4"],
    size: tuple[int, int],
) -> Resection | None:
    """The pose that most of the points agree on; None when fewer than six do.

    Args:
        pixels: counted as COLMAP does, half a pixel more than OpenCV.
        points: the same in the object's frame, metres.
        intrinsics: fx, fy, cx, cy as OpenCV counts.
        size: width and height of the picture.
    """
    fx, fy, cx, cy = intrinsics
    camera = pycolmap.Camera(
        model="PINHOLE", width=size[0], height=size[1], params=[fx, fy, cx + 0.5, cy + 0.5]
    )
    limit = _MAX_ERROR * size[0] / 640
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = limit
    options.ransac.random_seed = 0
    found = pycolmap.estimate_and_refine_absolute_pose(pixels, points, camera, options)
    kept = np.zeros(len(points), bool)
    for _ in range(_ROUNDS):
        if found is None:
            return None
        before, kept = kept, _kept(_matrix(found), pixels, points, intrinsics, limit)
        if kept.sum() < _FEWEST:
            return None
        if (kept == before).all():
            break
        pose = found["cam_from_world"]
        found = pycolmap.refine_absolute_pose(pose, pixels, points, kept, camera)
    if found is None:
        return None
    T = _matrix(found)
    off, J, _ = _linear(T, pixels[kept], points[kept], intrinsics)
    variance = float((off**2).sum() / (2 * len(off) - 6))
    shared = max(1.0, len(off) / _INDEPENDENT)
    covariance = np.linalg.inv(np.einsum("nki,nkj->ij", J, J)) * variance * shared
    return Resection(T, covariance, kept, float(np.sqrt((off**2).sum(axis=1).mean())))


def _matrix(found: dict[str, pycolmap.Rigid3d]) -> Float64[np.ndarray, "4 4"]:
    return np.concatenate([found["cam_from_world"].matrix(), [[0.0, 0.0, 0.0, 1.0]]])


def _kept(
    T: Float64[np.ndarray, "4 4"],
    pixels: Float64[np.ndarray, "points 2"],
    points: Float64[np.ndarray, "points 3"],
    intrinsics: Float64[np.ndarray, "4"],
    limit: float,
) -> Bool[np.ndarray, " points"]:
    """The points that agree with a pose, without those that it hangs on by themselves."""
    off, J, depth = _linear(T, pixels, points, intrinsics)
    kept = (np.linalg.norm(off, axis=1) < limit) & (depth > _NEAREST)
    if kept.sum() < _FEWEST:
        return kept
    covariance = np.linalg.pinv(np.einsum("nki,nkj->ij", J[kept], J[kept]))
    return kept & (np.einsum("nki,ij,nkj->n", J, covariance, J) < _MAX_LEVERAGE)


def _linear(
    T: Float64[np.ndarray, "4 4"],
    pixels: Float64[np.ndarray, "points 2"],
    points: Float64[np.ndarray, "points 3"],
    intrinsics: Float64[np.ndarray, "4"],
) -> tuple[
    Float64[np.ndarray, "points 2"],
    Float64[np.ndarray, "points 2 6"],
    Float64[np.ndarray, " points"],
]:
    """How far the points are off in the picture, how a step of the pose moves them, their depths."""
    turned = points @ T[:3, :3].T
    x, y, depth = (turned + T[:3, 3]).T
    z = np.where(np.abs(depth) < 1e-6, 1e-6, depth)
    fx, fy, cx, cy = intrinsics
    off = np.stack([fx * x / z + cx + 0.5, fy * y / z + cy + 0.5], axis=1) - pixels
    zero = np.zeros_like(x)
    rows = [[fx / z, zero, -fx * x / z**2], [zero, fy / z, -fy * y / z**2]]
    by_place = np.stack([np.stack(row, axis=-1) for row in rows], axis=1)
    return off, np.concatenate([-by_place @ skew(turned), by_place], axis=-1), depth
