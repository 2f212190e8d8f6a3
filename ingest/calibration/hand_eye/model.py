"""The unknowns of the hand-eye calibration, and their residuals.

P_i X = Z_i O_i, with P the phone in its world, O the target in its camera, X the mount and Z the
place of that camera in the phone's world. ARKit drifts: Z is another one at each sample.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.calibration.hand_eye.samples import PHONE_SD, Samples
from ingest.uncertainty import between, rotation, skew


@dataclass(frozen=True)
class HandEyeFit:
    """The unknowns of the hand-eye calibration, and how well they explain the samples."""

    T_phone_target: Float64[np.ndarray, "4 4"]
    T_world_camera: Float64[np.ndarray, "4 4"]
    """Before drift."""
    drift: Float64[np.ndarray, "n 6"]
    """Step of the phone's world at each sample: a turn about `centre` (rad), then a shift (m)."""
    centre: Float64[np.ndarray, "3"]
    offset: float
    """Seconds to add to the target's times, beyond those of the samples."""
    scale: float
    """Part by which the phone's distances, measured from `centre`, are shorter than the target's."""
    noise: Float64[np.ndarray, "2"]
    """Factors on the expected noise of turns and of shifts."""
    jitter: float
    """Seconds by which the stamps of single samples err."""
    walk: Float64[np.ndarray, "2"]
    """How far the drift walks in the square root of a second: rad, m."""
    kept: Bool[np.ndarray, " n"]
    """False where a sample is wild."""
    information: Float64[np.ndarray, "8 8"]
    """Of mount, offset and scale, whatever the drift."""
    errors: Float64[np.ndarray, "n 6"]
    """P X against Z O: rad and m in the phone's world."""


def world(fit: HandEyeFit) -> Float64[np.ndarray, "n 4 4"]:
    """T_world_camera at each sample."""
    T = np.tile(np.eye(4), (len(fit.drift), 1, 1))
    T[:, :3, :3] = rotation(fit.drift[:, :3])
    T[:, :3, 3] = fit.centre - T[:, :3, :3] @ fit.centre + fit.drift[:, 3:]
    return T @ fit.T_world_camera


def errors(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "n 6"]:
    """Residuals between the target's pose by the phone and by the camera."""
    seen = world(fit) @ samples.T_camera_target
    carried = samples.T_world_phone @ fit.T_phone_target
    carried[:, :3, 3] += fit.scale * _undrifted_place(fit, samples)
    return between(seen, carried)


def jacobians(
    fit: HandEyeFit, samples: Samples
) -> tuple[Float64[np.ndarray, "n 6 8"], Float64[np.ndarray, "n 6 6"]]:
    """Jacobians of the errors by mount, offset and scale, and by the drift at each sample."""
    n = len(samples.times)
    R_P = samples.T_world_phone[:, :3, :3]
    arm = R_P @ fit.T_phone_target[:3, 3]
    own, drift = np.zeros((n, 6, 8)), np.zeros((n, 6, 6))
    own[:, :3, 0:3] = own[:, 3:, 3:6] = R_P
    own[:, :, 6] = target_velocity(fit, samples)
    own[:, 3:, 7] = _undrifted_place(fit, samples)
    drift[:, range(6), range(6)] = -1.0
    drift[:, 3:, :3] = skew(samples.T_world_phone[:, :3, 3] - fit.centre + arm)
    return own, drift


def _undrifted_place(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "n 3"]:
    """The phone's places from `centre` without the drift.

    As they are logged, their drift would look like a scale: the phone seems to go too far.
    """
    away = samples.T_world_phone[:, :3, 3] - fit.centre - fit.drift[:, 3:]
    return np.einsum("nji,nj->ni", rotation(fit.drift[:, :3]), away)


def target_velocity(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "n 6"]:
    """Velocity of the target in the phone's world (rad/s, m/s), along which an error of a stamp moves it."""
    turning, moving = samples.velocity[:, :3], samples.velocity[:, 3:]
    arm = samples.T_world_phone[:, :3, :3] @ fit.T_phone_target[:3, 3]
    return np.concatenate([turning, moving + np.cross(turning, arm)], axis=1)


def weights(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "n 6 6"]:
    """The inverse of each error's covariance."""
    R_Z = world(fit)[:, :3, :3]
    turn = np.zeros((len(R_Z), 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = R_Z
    covariance = turn @ samples.target_covariance @ turn.swapaxes(-1, -2)
    lever = np.tile(np.eye(6), (len(R_Z), 1, 1))
    lever[:, 3:, :3] = -skew(samples.T_world_phone[:, :3, :3] @ fit.T_phone_target[:3, 3])
    covariance = covariance + lever @ np.diag(PHONE_SD**2) @ lever.swapaxes(-1, -2)
    size = np.repeat(fit.noise, 3)
    late = fit.jitter * target_velocity(fit, samples)
    return np.linalg.inv(covariance * np.outer(size, size) + late[:, :, None] * late[:, None, :])


def whitened(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "n 6"]:
    """The errors in units of their own spread, no component correlated with another."""
    root = np.linalg.cholesky(weights(fit, samples))
    return np.einsum("nji,nj->ni", root, fit.errors)
