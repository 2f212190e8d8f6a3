"""The model of hand-eye calibration: streams, samples, residuals and normal equations.

P_i X = Z_i O_i, with P the phone in its world, O the target in its camera, X the mount and Z the
place of that camera in the phone's world. ARKit drifts: Z is another one at each sample.

The drift is tied from each sample to the next, so that its part of the normal matrix is a band; it is
eliminated, and what is left are the eight numbers of mount, clock offset and scale.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float64
from scipy.linalg import solveh_banded

from ingest.uncertainty import between, rotation, rotation_vector, skew

MAX_GAP = 0.25
"""Seconds between two poses over which nothing is made up."""
_SPAN = 0.05
"""Seconds on each side over which velocities are taken; some logs stamp in steps of 10 ms."""


@dataclass(frozen=True)
class PoseStream:
    """Poses of one thing in one frame, metres."""

    times: Float64[np.ndarray, " poses"]
    """Seconds on the stream's own clock, strictly increasing."""
    T: Float64[np.ndarray, "poses 4 4"]
    covariance: Float64[np.ndarray, "poses 6 6"] | None = None
    """Covariance of each pose, as in `ingest.uncertainty`; None when the tracker does not tell."""

    def at(self, times: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, "n 4 4"]:
        """Poses between those of the stream: turned evenly, moved evenly; held at its ends."""
        inside = np.clip(times, self.times[0], self.times[-1])
        after = np.searchsorted(self.times, inside).clip(1, len(self.times) - 1)
        start, end = self.times[after - 1], self.times[after]
        part = ((inside - start) / (end - start))[:, None]
        before, behind = self.T[after - 1], self.T[after]
        turn = rotation_vector(before[:, :3, :3].swapaxes(-1, -2) @ behind[:, :3, :3])
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3] = before[:, :3, :3] @ rotation(part * turn)
        T[:, :3, 3] = (1 - part) * before[:, :3, 3] + part * behind[:, :3, 3]
        return T

    def velocity(self, times: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, "n 6"]:
        """Angular velocity (rad/s) and velocity of the origin (m/s) in the outer frame's axes."""
        before, after = self.at(times - _SPAN), self.at(times + _SPAN)
        turn = rotation_vector(after[:, :3, :3] @ before[:, :3, :3].swapaxes(-1, -2))
        return np.concatenate([turn, after[:, :3, 3] - before[:, :3, 3]], axis=1) / (2 * _SPAN)

    def known(self, times: Float64[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
        """Whether a time lies within the stream and not in a gap of it."""
        after = np.searchsorted(self.times, times).clip(1, len(self.times) - 1)
        gap = self.times[after] - self.times[after - 1]
        return (times >= self.times[0]) & (times <= self.times[-1]) & (gap <= MAX_GAP)


_MOST = 240
"""Samples used: more of a correlated stream say nothing new."""
PHONE_SD = np.array([np.radians(0.1)] * 3 + [0.002] * 3)
"""Standard deviations of an ARKit pose between moments, rad and m, before the data itself is asked."""
TARGET_SD = np.array([np.radians(0.3)] * 3 + [0.003] * 3)
"""Standard deviations of a pose of a tracker that states none, rad and m."""


@dataclass(frozen=True)
class Samples:
    """Simultaneous poses of phone and target, in pairs."""

    times: Float64[np.ndarray, " n"]
    """On the target's clock, seconds."""
    T_world_phone: Float64[np.ndarray, "n 4 4"]
    T_camera_target: Float64[np.ndarray, "n 4 4"]
    target_covariance: Float64[np.ndarray, "n 6 6"]
    velocity: Float64[np.ndarray, "n 6"]
    """Velocity of the phone in its world: rad/s, m/s."""

    def later(self, phone: PoseStream, seconds: float) -> "Samples":
        """The samples with the phone's poses of `seconds` after the target's times."""
        at = self.times + seconds
        return replace(self, T_world_phone=phone.at(at), velocity=phone.velocity(at))


def paired(phone: PoseStream, target: PoseStream, offset: float) -> Samples:
    """Samples evenly over the time in which both streams are known; at most a few hundred.

    They are taken where the stream that has fewer poses has one: between those it is a guess.
    """
    if np.median(np.diff(phone.times)) > np.median(np.diff(target.times)):
        times = phone.times - offset
        both = np.flatnonzero(target.known(times))
    else:
        times = target.times
        both = np.flatnonzero(phone.known(times + offset))
    if len(both) > _MOST:
        both = both[np.linspace(0, len(both) - 1, _MOST).round().astype(int)]
    times = times[both]
    nearest = np.abs(target.times[:, None] - times).argmin(axis=0)
    return Samples(
        times,
        phone.at(times + offset),
        target.at(times),
        _covariances(target)[nearest],
        phone.velocity(times + offset),
    )


def matched(phone: PoseStream, target: PoseStream) -> Samples:
    """Samples of streams whose poses belong together one by one, whatever their times."""
    still = np.zeros((len(target.times), 6))
    return Samples(target.times, phone.T, target.T, _covariances(target), still)


def _covariances(target: PoseStream) -> Float64[np.ndarray, "poses 6 6"]:
    if target.covariance is not None:
        return target.covariance
    return np.tile(np.diag(TARGET_SD**2), (len(target.times), 1, 1))


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
    """Information of mount, offset and scale, whatever the drift."""
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


PRIOR_SD = np.array([3.0] * 3 + [0.5] * 3)
"""What is believed of a mount that nothing shows: any turn, half a metre."""
_OFFSET_SD = 0.1
_KNOWN_OFFSET_SD = 1e-6
_SCALE_SD = 0.02
"""Odometry, a board's squares and a lens disagree about lengths: by 2.5 % between two phones measured."""


class GaussNewtonStep(NamedTuple):
    """One step of Gauss-Newton, and the information matrix behind it."""

    own: Float64[np.ndarray, "8"]
    """Mount (rad, m), offset (s) and scale."""
    drift: Float64[np.ndarray, "n 6"]
    information: Float64[np.ndarray, "8 8"]
    """Information of `own`, whatever the drift."""


def gauss_newton(fit: HandEyeFit, samples: Samples, *, timed: bool) -> GaussNewtonStep:
    """The step that explains the kept samples best, with a slow drift and a mount near the phone.

    Args:
        fit: where it stands.
        samples: both trackers at the fit's offset.
        timed: the offset is to be found too.
    """
    own, drift = jacobians(fit, samples)
    weight = weights(fit, samples) * fit.kept[:, None, None]
    pull = np.einsum("nij,nj->ni", weight, fit.errors)
    H_own = np.einsum("nki,nkl,nlj->ij", own, weight, own)
    g_own = np.einsum("nki,nk->i", own, pull)
    sd = np.append(PRIOR_SD, [_OFFSET_SD if timed else _KNOWN_OFFSET_SD, _SCALE_SD])
    H_own += np.diag(sd**-2)
    g_own[3:6] += fit.T_phone_target[:3, 3] / sd[3:6] ** 2
    g_own[6:] += np.array([fit.offset, fit.scale]) / sd[6:] ** 2
    drift_t = drift.swapaxes(-1, -2)
    across = (drift_t @ weight @ own).reshape(-1, 8)
    band, g_walk = _band(drift_t @ weight @ drift, fit, samples)
    g_drift = np.einsum("nij,nj->ni", drift_t, pull).reshape(-1) + g_walk
    solved = solveh_banded(band, np.column_stack([across, g_drift]), lower=True)
    information = H_own - across.T @ solved[:, :8]
    step = -np.linalg.solve(information, g_own - across.T @ solved[:, 8])
    walked = -(solved[:, 8] + solved[:, :8] @ step)
    return GaussNewtonStep(step, walked.reshape(-1, 6), (information + information.T) / 2)


def _band(
    blocks: Float64[np.ndarray, "n 6 6"], fit: HandEyeFit, samples: Samples
) -> tuple[Float64[np.ndarray, "12 rows"], Float64[np.ndarray, " rows"]]:
    """The drift's normal matrix with the walk's ties, as its lower diagonals; the ties' slope."""
    n = len(blocks)
    gaps = np.maximum(np.diff(samples.times), 1e-6)
    tie = 1 / (gaps[:, None] * np.repeat(fit.walk, 3) ** 2)
    beside = np.zeros((n, 6))
    beside[1:] += tie
    beside[:-1] += tie
    diagonal = blocks + beside[:, :, None] * np.eye(6)
    band = np.zeros((12, n, 6))
    for below in range(6):
        for column in range(6 - below):
            band[below, :, column] = diagonal[:, column + below, column]
    band[6, :-1] = -tie
    pull = np.zeros((n, 6))
    apart = tie * np.diff(fit.drift, axis=0)
    pull[1:] += apart
    pull[:-1] -= apart
    return band.reshape(12, -1), pull.reshape(-1)
