"""What a covariance of a rigid transform says in millimetres and degrees, and elsewhere on the object."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

_DRAWS = 20_000


class ConfidenceRadii(NamedTuple):
    """Radii within which the truth lies with 95 %, each by itself."""

    mm: float
    """Bound of the position of the object's origin, millimetres."""
    deg: float
    """Bound of the rotation, degrees."""


def bounds_95(covariance: Float64[np.ndarray, "6 6"]) -> ConfidenceRadii:
    """95 % radii of a covariance of rotation (rad) and translation (m)."""
    return ConfidenceRadii(
        1e3 * _radius(covariance[3:, 3:]), float(np.degrees(_radius(covariance[:3, :3])))
    )


def _radius(covariance: Float64[np.ndarray, "3 3"]) -> float:
    """95th percentile of the length of a normal vector; by drawing, which is exact to a percent."""
    draws = np.random.default_rng(0).standard_normal((_DRAWS, 3))
    spread = np.sqrt(np.linalg.eigvalsh(covariance).clip(0))
    return float(np.quantile(np.linalg.norm(draws * spread, axis=1), 0.95))


def moved(
    T: Float64[np.ndarray, "*#batch 4 4"], step: Float64[np.ndarray, "*#batch 6"]
) -> Float64[np.ndarray, "*batch 4 4"]:
    """T after a step of rotation vector (rad) and translation (m) in the outer frame's axes."""
    out = np.broadcast_to(T, (*step.shape[:-1], 4, 4)).copy()
    out[..., :3, :3] = rotation(step[..., :3]) @ T[..., :3, :3]
    out[..., :3, 3] += step[..., 3:]
    return out


def between(
    T: Float64[np.ndarray, "*#batch 4 4"], other: Float64[np.ndarray, "*#batch 4 4"]
) -> Float64[np.ndarray, "*batch 6"]:
    """The step with which `moved(T, step)` is `other`."""
    turn = other[..., :3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2)
    return np.concatenate([rotation_vector(turn), other[..., :3, 3] - T[..., :3, 3]], axis=-1)


def rotation(vector: Float64[np.ndarray, "*batch 3"]) -> Float64[np.ndarray, "*batch 3 3"]:
    """Rotation matrices of rotation vectors (rad)."""
    flat = Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix()
    return flat.reshape(*vector.shape[:-1], 3, 3)


def rotation_vector(R: Float64[np.ndarray, "*batch 3 3"]) -> Float64[np.ndarray, "*batch 3"]:
    """Rotation vectors (rad, up to pi) of rotation matrices."""
    return Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec().reshape(*R.shape[:-2], 3)


def skew(vector: Float64[np.ndarray, "*batch 3"]) -> Float64[np.ndarray, "*batch 3 3"]:
    """Matrices that multiply like the cross product with these vectors."""
    zero = np.zeros_like(vector[..., 0])
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def of_inverse(
    T: Float64[np.ndarray, "4 4"], covariance: Float64[np.ndarray, "6 6"]
) -> Float64[np.ndarray, "6 6"]:
    """The covariance of the inverse of T, in the axes of T's inner frame."""
    R, t = T[:3, :3], T[:3, 3]
    J = np.zeros((6, 6))
    J[:3, :3] = -R.T
    J[3:, :3] = -R.T @ skew(t)
    J[3:, 3:] = -R.T
    return J @ covariance @ J.T


def of_product(
    T_a_b: Float64[np.ndarray, "4 4"],
    covariance_ab: Float64[np.ndarray, "6 6"],
    T_b_c: Float64[np.ndarray, "4 4"],
    covariance_bc: Float64[np.ndarray, "6 6"],
) -> Float64[np.ndarray, "6 6"]:
    """The covariance of T_a_b @ T_b_c, whose errors have nothing to do with each other."""
    R = T_a_b[:3, :3]
    outer = np.eye(6)
    outer[3:, :3] = -skew(R @ T_b_c[:3, 3])
    inner = np.zeros((6, 6))
    inner[:3, :3] = R
    inner[3:, 3:] = R
    return outer @ covariance_ab @ outer.T + inner @ covariance_bc @ inner.T
