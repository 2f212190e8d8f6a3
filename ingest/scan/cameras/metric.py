"""to_phone: how a model of any size lies in the world in which a phone logged its poses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.uncertainty import rotation, rotation_vector, skew

_JITTER, _WALK = 0.002, 0.003
"""Errors of a phone's positions: of each by itself (m), and what is added each metre walked (m)."""
_TURN = np.radians(0.3)
"""Error of each of its rotations, rad."""
_JUMP = 5.0
"""Sigmas of a step beyond which the phone has corrected itself there, and the step says nothing."""
_ROUNDS = 8
ARKIT_SCALE = 0.004
"""Standard deviation of the length of ARKit's metre, which its own poses do not show, as a part."""


@dataclass(frozen=True)
class Similarity:
    """a = scale R b + t."""

    scale: float
    R: Float64[np.ndarray, "3 3"]
    t: Float64[np.ndarray, "3"]
    sigma: float = 0.0
    """Of the scale, as a part of it."""

    def points(self, b: Float64[np.ndarray, "points 3"]) -> Float64[np.ndarray, "points 3"]:
        """Points of b in a."""
        return self.scale * b @ self.R.T + self.t

    def poses(self, T_b_c: Float64[np.ndarray, "poses 4 4"]) -> Float64[np.ndarray, "poses 4 4"]:
        """Rigid poses in b as poses in a."""
        T = T_b_c.copy()
        T[:, :3, :3] = self.R @ T_b_c[:, :3, :3]
        T[:, :3, 3] = self.points(T_b_c[:, :3, 3])
        return T


def to_phone(
    T_phone_camera: Float64[np.ndarray, "poses 4 4"],
    T_model_camera: Float64[np.ndarray, "poses 4 4"],
) -> Similarity:
    """The similarity that lays a model's cameras on those of a phone's log, the same in their order.

    A phone's errors walk: far poses differ by centimetres where neighbours agree to millimetres. So
    it is steps that count, not places (generalised least squares); steps at which the phone has
    corrected its world are left out. Rotations count too, and settle what a straight path leaves open.
    """
    found = _start(T_phone_camera, T_model_camera)
    length = np.linalg.norm(np.diff(T_model_camera[:, :3, 3], axis=0), axis=1)
    jump = np.zeros(len(length))
    for _ in range(_ROUNDS):
        walk = _WALK**2 * found.scale * length + jump
        found, off = _step(found, T_phone_camera, T_model_camera, walk)
        jump = _jumps(off, walk)
    return found


def _step(
    now: Similarity,
    T_phone_camera: Float64[np.ndarray, "poses 4 4"],
    T_model_camera: Float64[np.ndarray, "poses 4 4"],
    walk: Float64[np.ndarray, " steps"],
) -> tuple[Similarity, Float64[np.ndarray, "poses 3"]]:
    """A step of Gauss and Newton, and how far positions were off before it."""
    turned = now.scale * T_model_camera[:, :3, 3] @ now.R.T
    off = T_phone_camera[:, :3, 3] - turned - now.t
    back = (now.R @ T_model_camera[:, :3, :3]).swapaxes(1, 2)
    twist = rotation_vector(T_phone_camera[:, :3, :3] @ back)
    J = np.zeros((len(off), 3, 7))
    J[:, :, :3], J[:, :, 3], J[:, :, 4:] = -skew(turned), turned, np.eye(3)
    L = np.linalg.cholesky(_covariance(walk))
    white = np.linalg.solve(L, off)
    white_J = np.linalg.solve(L, J.reshape(len(off), -1)).reshape(J.shape)
    weight = _cauchy(np.linalg.norm(twist, axis=1) / _TURN) / _TURN**2
    normal = np.einsum("nki,nkj->ij", white_J, white_J)
    normal[:3, :3] += np.eye(3) * weight.sum()
    right = np.einsum("nki,nk->i", white_J, white)
    right[:3] += (weight[:, None] * twist).sum(axis=0)
    step = np.linalg.solve(normal, right)
    # Where positions err more than a phone's do, the scale is less sure by as much.
    variance = np.linalg.inv(normal)[3, 3] * max(1.0, float((white**2).mean()))
    sigma = float(np.sqrt(variance + ARKIT_SCALE**2))
    scale = now.scale * float(np.exp(step[3]))
    return Similarity(scale, rotation(step[:3]) @ now.R, now.t + step[4:], sigma), off


def _covariance(walk: Float64[np.ndarray, " steps"]) -> Float64[np.ndarray, "poses poses"]:
    """Covariance of one axis of all positions: independent errors, and a random walk."""
    carried = np.concatenate([[0.0], np.cumsum(walk)])
    return np.minimum.outer(carried, carried) + _JITTER**2 * np.eye(len(carried))


def _jumps(
    off: Float64[np.ndarray, "poses 3"], walk: Float64[np.ndarray, " steps"]
) -> Float64[np.ndarray, " steps"]:
    """Variance to add to steps that are farther off than walking explains."""
    step = np.linalg.norm(np.diff(off, axis=0), axis=1)
    usual = np.sqrt(3 * (walk + 2 * _JITTER**2))
    usual = np.maximum(usual, np.median(step))
    return np.where(step > _JUMP * usual, 100 * step**2, 0.0)


def _cauchy(sigmas: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    return 1 / (1 + (sigmas / 3) ** 2)


def _start(
    T_phone_camera: Float64[np.ndarray, "poses 4 4"],
    T_model_camera: Float64[np.ndarray, "poses 4 4"],
) -> Similarity:
    """Rotation by the rotations, which no path leaves open; scale and place by medians."""
    R_each = T_phone_camera[:, :3, :3] @ T_model_camera[:, :3, :3].swapaxes(1, 2)
    R = _typical(R_each)
    ours, theirs = T_model_camera[:, :3, 3] @ R.T, T_phone_camera[:, :3, 3]
    spread = [np.linalg.norm(x - np.median(x, axis=0), axis=1) for x in (theirs, ours)]
    scale = float(np.median(spread[0]) / max(float(np.median(spread[1])), 1e-12))
    return Similarity(scale, R, np.median(theirs - scale * ours, axis=0))


def _typical(R: Float64[np.ndarray, "n 3 3"]) -> Float64[np.ndarray, "3 3"]:
    """The rotation with which most of the others agree."""
    traces = np.einsum("nij,mij->nm", R, R).clip(-1, 3)
    return R[int(np.median(np.arccos(((traces - 1) / 2).clip(-1, 1)), axis=1).argmin())]
