"""Poses that reproject best, and their covariance: Levenberg-Marquardt on many frames at once."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.calibration.board.lens import Sightings
from ingest.uncertainty import moved

_LEAST = 1e-9
"""Part of the information that is added: frames of nonsense show nothing of some direction."""
_ROUNDS = 30
_DONE = 1e-7
"""Radians and metres: a step as small changes nothing."""


@dataclass(frozen=True)
class BoardFit:
    """The pose of the board in each frame, and its residuals."""

    T: Float64[np.ndarray, "frames 4 4"]
    """T_camera_board."""
    off: Float64[np.ndarray, "frames corners"]
    """Pixels between a corner and where the pose puts it; 0 where not seen."""
    cost: Float64[np.ndarray, " frames"]
    """Sum of squares over the corners used, pixels^2."""


def fit(
    sightings: Sightings,
    used: Bool[np.ndarray, "frames corners"],
    start: Float64[np.ndarray, "frames 4 4"],
) -> BoardFit:
    """The poses nearest to `start` at which the corners used reproject best."""
    T = start.copy()
    damping = np.full(len(T), 1e-3)
    cost = _cost(residuals(sightings, T), used)
    open_ = np.ones(len(T), bool)
    for _ in range(_ROUNDS):
        k = np.flatnonzero(open_)
        if len(k) == 0:
            break
        part = sightings.of(k)
        J, r = jacobian(part, T[k]), residuals(part, T[k])
        A, b = _normal(J, r, used[k])
        A[:, range(6), range(6)] *= 1 + damping[k, None]
        even, size = _evened(A)
        step = size * np.linalg.solve(even, (size * b)[..., None])[..., 0]
        tried = moved(T[k], step)
        new = _cost(residuals(part, tried), used[k])
        better = new < cost[k]
        T[k[better]], cost[k[better]] = tried[better], new[better]
        damping[k] *= np.where(better, 0.2, 8.0)
        open_[k] = (np.abs(step).max(axis=1) > _DONE) & (damping[k] < 1e6)
    off = np.linalg.norm(residuals(sightings, T), axis=-1) * sightings.seen
    return BoardFit(T, off, cost)


def covariances(
    sightings: Sightings,
    used: Bool[np.ndarray, "frames corners"],
    T: Float64[np.ndarray, "frames 4 4"],
    sigma: Float64[np.ndarray, " frames"],
) -> Float64[np.ndarray, "frames 6 6"]:
    """Covariances of the poses, for corners with errors of `sigma` pixels along each axis.

    Of `ingest.uncertainty`: rotation (rad), then translation (m), in the camera's axes.
    """
    J = jacobian(sightings, T)
    A, _ = _normal(J, residuals(sightings, T), used)
    even, size = _evened(A)
    return np.linalg.inv(even) * size[:, :, None] * size[:, None, :] * sigma[:, None, None] ** 2


def residuals(
    sightings: Sightings, T: Float64[np.ndarray, "frames 4 4"]
) -> Float64[np.ndarray, "frames corners 2"]:
    """Seen minus projected, pixels; nonsense where not seen."""
    P = sightings.points @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    # A pose that puts the board behind the camera is never better than one in front of it.
    depth = np.where(P[..., 2:] > 1e-6, P[..., 2:], 1e-6)
    return _in_pixels(sightings, sightings.direction - P[..., :2] / depth)


def jacobian(
    sightings: Sightings, T: Float64[np.ndarray, "frames 4 4"]
) -> Float64[np.ndarray, "frames corners 2 6"]:
    """Jacobian of the projection (pixels) by a step of `ingest.uncertainty.moved`."""
    arm = sightings.points @ T[:, :3, :3].swapaxes(1, 2)
    P = arm + T[:, None, :3, 3]
    depth = np.where(P[..., 2:] > 1e-6, P[..., 2:], 1e-6)
    x, y = np.moveaxis(P[..., :2] / depth, -1, 0)
    a, b, c = np.moveaxis(arm, -1, 0)
    one, zero = np.ones_like(x), np.zeros_like(x)
    # d(x/z) and d(y/z) times z: along r (about the board's origin), then along t.
    u = np.stack([-x * b, c + x * a, -b, one, zero, -x], axis=-1)
    v = np.stack([-c - y * b, y * a, a, zero, one, -y], axis=-1)
    slope = np.stack([u, v], axis=-1) / depth[..., None]
    return np.moveaxis(_in_pixels(sightings, np.moveaxis(slope, 2, 0)), 0, -1)


def _in_pixels(
    sightings: Sightings, change: Float64[np.ndarray, "*batch frames corners 2"]
) -> Float64[np.ndarray, "*batch frames corners 2"]:
    """Changes of directions as changes of pixels; written out, which is faster than matrices."""
    A, x, y = sightings.to_pixels, change[..., 0], change[..., 1]
    return np.stack([A[..., 0, 0] * x + A[..., 0, 1] * y, A[..., 1, 0] * x + A[..., 1, 1] * y], -1)


def _normal(
    J: Float64[np.ndarray, "frames corners 2 6"],
    r: Float64[np.ndarray, "frames corners 2"],
    used: Bool[np.ndarray, "frames corners"],
) -> tuple[Float64[np.ndarray, "frames 6 6"], Float64[np.ndarray, "frames 6"]]:
    rows = (J * used[..., None, None]).reshape(len(J), 2 * used.shape[1], 6)
    turned = rows.swapaxes(1, 2)
    return turned @ rows, (turned @ r.reshape(len(J), 2 * used.shape[1], 1))[..., 0]


def _evened(
    A: Float64[np.ndarray, "frames 6 6"],
) -> tuple[Float64[np.ndarray, "frames 6 6"], Float64[np.ndarray, "frames 6"]]:
    """A with ones on its diagonal, which can be inverted whatever the scales; and the scales."""
    size = 1 / np.sqrt(np.einsum("fii->fi", A) + 1e-300)
    return A * size[:, :, None] * size[:, None, :] + _LEAST * np.eye(6), size


def _cost(
    r: Float64[np.ndarray, "frames corners 2"], used: Bool[np.ndarray, "frames corners"]
) -> Float64[np.ndarray, " frames"]:
    return ((r * r).sum(axis=2) * used).sum(axis=1)
