"""Rigid transforms (numpy): inverses, Procrustes fits, speeds and their noise, and shortest turns."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Float64
from scipy.spatial.transform import Rotation
from scipy.special import gammaincinv


def apply(T_a_b: Float[np.ndarray, "frames 4 4"], points_b: Float[np.ndarray, "points 3"]):
    """Points of frame b in frame a, for each frame: (frames, points, 3)."""
    return points_b @ T_a_b[:, :3, :3].swapaxes(-1, -2) + T_a_b[:, None, :3, 3]


def to_local(
    T_a_b: Float[np.ndarray, "frames 4 4"], points_a: Float[np.ndarray, "frames points 3"]
) -> Float[np.ndarray, "frames points 3"]:
    """Points of frame a in frame b, for each frame."""
    return (points_a - T_a_b[:, None, :3, 3]) @ T_a_b[:, :3, :3]


def inverse(T_a_b: Float[np.ndarray, "*batch 4 4"]) -> Float[np.ndarray, "*batch 4 4"]:
    """T_b_a of a rigid T_a_b."""
    T_b_a = np.zeros_like(T_a_b)
    R_b_a = T_a_b[..., :3, :3].swapaxes(-1, -2)
    T_b_a[..., :3, :3] = R_b_a
    T_b_a[..., :3, 3] = -np.einsum("...ij,...j->...i", R_b_a, T_a_b[..., :3, 3])
    T_b_a[..., 3, 3] = 1.0
    return T_b_a


def velocity(
    x: Float[np.ndarray, " frames *rest"], fps: float
) -> Float[np.ndarray, " frames *rest"]:
    """Central differences, one-sided at the ends, in units per second; zero for a single frame."""
    return np.gradient(x, axis=0) * fps if len(x) > 1 else np.zeros_like(x)


def turning_speed(
    R_a_b: Float[np.ndarray, "frames *joints 3 3"], fps: float
) -> Float[np.ndarray, " frames *joints"]:
    """How fast rotations turn from each frame to the next, rad/s; 0 in the last frame."""
    turns = np.swapaxes(R_a_b[:-1], -1, -2) @ R_a_b[1:]
    cosine = (np.trace(turns, axis1=-2, axis2=-1) - 1) / 2
    speed = np.arccos(cosine.clip(-1.0, 1.0)) * fps
    return np.concatenate([speed, np.zeros_like(R_a_b[:1, ..., 0, 0])])


def angular_velocity(
    R_world_body: Float[np.ndarray, "frames 3 3"], fps: float
) -> Float[np.ndarray, "frames 3"]:
    """Angular velocity in the world, rad/s: that from each frame to the next, the last repeated."""
    if len(R_world_body) < 2:
        return np.zeros((len(R_world_body), 3))
    step = R_world_body[1:] @ R_world_body[:-1].swapaxes(-1, -2)
    omega = Rotation.from_matrix(step).as_rotvec() * fps
    return np.concatenate([omega, omega[-1:]])


_SIXTH = np.zeros(13)
_SIXTH[::2] = np.array([1.0, -6, 15, -20, 15, -6, 1]) / np.sqrt(924)
"""Sixth difference of every other frame: what is smooth over 0.4 s goes, white noise keeps its size.

Of neighbouring frames it would see little: a pose between two logged ones is their mean.
"""


def frame_noise(
    T: Float[np.ndarray, "frames 4 4"], valid: Bool[np.ndarray, " frames"], quiet_share: float
) -> tuple[float, float]:
    """Return the noise from frame to frame on each axis (standard deviation): metres, rad.

    Sixth differences leave what hardly any motion does. The quietest part of the take tells, so brisk
    motion in the rest of it does not count.

    Args:
        T: poses at 30 fps.
        valid: frames that count.
        quiet_share: which part that is.
    """
    windows = np.lib.stride_tricks.sliding_window_view
    whole = windows(valid, len(_SIXTH)).all(axis=1) if len(T) >= len(_SIXTH) else np.empty(0, bool)
    if not whole.any():
        return 0.0, 0.0
    left = windows(T[:, :3], len(_SIXTH), axis=0)[whole] @ _SIXTH
    # The quantile of a chi-squared variable of three dimensions.
    expected = 2 * float(gammaincinv(1.5, quiet_share))
    shift = np.quantile((left[..., 3] ** 2).sum(axis=1), quiet_share) / expected
    # A small turn by a vector r moves the three columns of a rotation by 2 |r|^2 in all.
    turn = np.quantile((left[..., :3] ** 2).sum(axis=(1, 2)), quiet_share) / 2 / expected
    return float(np.sqrt(shift)), float(np.sqrt(turn))


def nearest_rotation(
    M: Float64[np.ndarray, "*batch 3 3"],
) -> Float64[np.ndarray, "*batch 3 3"]:
    """The rotation R that is nearest to M in the Frobenius norm; never a mirror image.

    With M = sum of a_i b_i^T this is the R of least squares with a = R b (Kabsch).
    """
    U, _, Vt = np.linalg.svd(M)
    U[..., 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[..., None]
    return U @ Vt


class SimilarityTransform(NamedTuple):
    """a = scale R b + t, and how well it fits."""

    R: Float64[np.ndarray, "3 3"]
    """A rotation, or a mirrored one where that was allowed."""
    t: Float64[np.ndarray, "3"]
    scale: float
    residuals: Float64[np.ndarray, "n 3"]
    """What is left of each point, a - (scale R b + t), metres."""
    misfit: float
    """Weighted sum of their squares."""


def procrustes(
    points_a: Float64[np.ndarray, "n 3"],
    points_b: Float64[np.ndarray, "n 3"],
    weights: Float64[np.ndarray, " n"],
    *,
    scaled: bool = False,
    mirrored: bool = False,
) -> SimilarityTransform:
    """Weighted least squares over rotations, shifts and, where asked, scales (Umeyama 1991).

    Args:
        points_a, points_b: the same points in frames a and b; at least two of b's differ.
        weights: of each pair; 1 / sigma^2 makes the misfit a chi-square.
        scaled: solve for the scale too, else it is 1.
        mirrored: take the best mirror image instead of the best rotation.
    """
    share = weights / weights.sum()
    middle_a, middle_b = share @ points_a, share @ points_b
    a, b = points_a - middle_a, points_b - middle_b
    U, stretch, Vt = np.linalg.svd((a * share[:, None]).T @ b)
    hand = np.linalg.det(U) * np.linalg.det(Vt) * (-1 if mirrored else 1)
    signs = np.array([1.0, 1.0, np.sign(hand)])
    R = (U * signs) @ Vt
    scale = float((stretch * signs).sum() / (share @ (b**2).sum(axis=1))) if scaled else 1.0
    t = middle_a - scale * R @ middle_b
    residuals = points_a - (scale * points_b @ R.T + t)
    return SimilarityTransform(R, t, scale, residuals, float(weights @ (residuals**2).sum(axis=1)))


def shortest_turn(
    old: Float[np.ndarray, "3"], new: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation R with R old along new; about any axis across them where they oppose.

    Exact for every pair of directions: the common closed form loses all digits near half a turn, and so
    does scipy's `Rotation.align_vectors` some.

    Args:
        old, new: of any length but zero, in the same frame.
    """
    old, new = (np.asarray(v, np.float64) / np.linalg.norm(v) for v in (old, new))
    if old @ new < 0:
        # Half a turn about the axis of the whole, then the rest the other way.
        axis = _across(old, new)
        return shortest_turn(-old, new) @ (2 * np.outer(axis, axis) - np.eye(3))
    x, y, z = np.cross(old, new)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + K + K @ K / (1 + old @ new)


def _across(old: Float[np.ndarray, "3"], new: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """A unit vector square to the unit vector `old`, and to `new` unless they oppose."""
    axis = np.cross(old, new)
    if np.linalg.norm(axis) < 1e-9:
        axis = np.cross(old, np.eye(3)[np.abs(old).argmin()])
    axis = axis / np.linalg.norm(axis)
    axis = axis - (axis @ old) * old
    return axis / np.linalg.norm(axis)
