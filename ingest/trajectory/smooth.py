"""Poses resampled to 30 fps by time, and smoothed within the sensor's noise."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation, Slerp

from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import SMOOTHING
from omomo_core.motion import FPS

_MAD = 1.4826


@dataclass(frozen=True)
class Noise:
    """Standard deviation on each axis of what is random from pose to pose."""

    position: float
    """Metres."""
    rotation: float
    """rad."""


def smooth(session: CaptureSession, broken: Bool[np.ndarray, " steps"]) -> CaptureSession:
    """Fit a parabola to each seven poses and move the middle one towards it, by the noise at most.

    Only in a log that has noise and is denser than 40 Hz, and never across a break. Position and
    rotation are judged apart.
    """
    noise = measure_noise(session, broken)
    if noise is None or np.median(np.diff(session.times)) > SMOOTHING.longest_period:
        return session
    whole, t = _windows(session.times, broken)
    shift, turn = _local(session.T_world_phone, whole, _parabola_weights(t))
    T = session.T_world_phone.copy()
    if noise.position > SMOOTHING.least_noise:
        T[whole, :3, 3] += _clipped(
            shift, min(SMOOTHING.sigmas * noise.position, SMOOTHING.largest_shift)
        )
    if noise.rotation > np.radians(SMOOTHING.least_turn_noise):
        bounded = _clipped(
            turn, min(SMOOTHING.sigmas * noise.rotation, np.radians(SMOOTHING.largest_turn))
        )
        T[whole, :3, :3] = T[whole, :3, :3] @ Rotation.from_rotvec(bounded).as_matrix()
    return replace(session, T_world_phone=T)


def measure_noise(session: CaptureSession, broken: Bool[np.ndarray, " steps"]) -> Noise | None:
    """The noise of a log from its own poses; None when no seven poses follow without a break.

    A combination of seven poses in which every motion cancels that is a polynomial of fifth degree
    in time (their sixth divided difference) leaves the noise. The median makes it robust.
    """
    whole, t = _windows(session.times, broken)
    if len(whole) == 0:
        return None
    shift, turn = _local(session.T_world_phone, whole, _difference_weights(t))
    return Noise(float(_MAD * np.median(np.abs(shift))), float(_MAD * np.median(np.abs(turn))))


def _windows(
    times: Float64[np.ndarray, " frames"], broken: Bool[np.ndarray, " steps"]
) -> tuple[np.ndarray, Float64[np.ndarray, "windows 7"]]:
    """The middle pose of each seven without a break, and their times from it in typical steps."""
    width = 2 * SMOOTHING.half_window + 1
    if len(times) < width:
        return np.empty(0, int), np.empty((0, width))
    view = np.lib.stride_tricks.sliding_window_view
    whole = np.flatnonzero(~view(broken, width - 1).any(axis=1)) + SMOOTHING.half_window
    near = times[whole[:, None] + np.arange(-SMOOTHING.half_window, SMOOTHING.half_window + 1)]
    return whole, (near - times[whole, None]) / np.median(np.diff(times))


def _parabola_weights(t: Float64[np.ndarray, "windows 7"]) -> Float64[np.ndarray, "windows 7"]:
    """What each pose counts in the least-squares parabola's value at the middle."""
    A = t[:, :, None] ** np.arange(3)
    first = np.tile([[1.0], [0.0], [0.0]], (len(t), 1, 1))
    return (A @ np.linalg.solve(A.swapaxes(1, 2) @ A, first))[:, :, 0]


def _difference_weights(t: Float64[np.ndarray, "windows 7"]) -> Float64[np.ndarray, "windows 7"]:
    """Sixth divided difference, scaled so that white noise keeps its size."""
    apart = t[:, :, None] - t[:, None, :] + np.eye(t.shape[1])
    weights = 1 / apart.prod(axis=2)
    return weights / np.linalg.norm(weights, axis=1, keepdims=True)


def _local(
    T: Float64[np.ndarray, "frames 4 4"],
    middle: np.ndarray,
    weights: Float64[np.ndarray, "windows 7"],
) -> tuple[Float64[np.ndarray, "windows 3"], Float64[np.ndarray, "windows 3"]]:
    """Weighted sum of each seven poses seen from the middle one: metres in the world, rad in its axes.

    Small rotations add up like the skew parts of their matrices.
    """
    total = np.zeros((len(middle), 3, 4))
    for k, weight in enumerate(weights.T):
        total += weight[:, None, None] * (T[middle + k - SMOOTHING.half_window, :3] - T[middle, :3])
    turned = T[middle, :3, :3].swapaxes(1, 2) @ total[:, :, :3]
    skew = (turned - turned.swapaxes(1, 2)) / 2
    return total[:, :, 3], np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)


def _clipped(vectors: Float64[np.ndarray, "n 3"], longest: float) -> Float64[np.ndarray, "n 3"]:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(size, 1e-12))


_SAME_TIME = 1e-6
"""Seconds; Unix stamps in double precision are good to less than this."""


def resample(
    times: Float64[np.ndarray, " logged"],
    T: Float64[np.ndarray, "logged 4 4"],
    broken: Bool[np.ndarray, " steps"],
) -> tuple[Float64[np.ndarray, "frames 4 4"], Bool[np.ndarray, " frames"]]:
    """Poses at times[0] + k/30, and which of them are measured rather than guessed.

    Args:
        times: seconds, strictly increasing.
        T: the poses at these times.
        broken: marks the steps (pose i to i+1) that must not be bridged. Each costs the frames
            after pose i up to pose i+1, and at least one frame, so that a motion is always split.
    """
    count = int((times[-1] - times[0]) * FPS + _SAME_TIME) + 1
    grid = np.minimum(times[0] + np.arange(count) / FPS, times[-1])
    out = np.tile(np.eye(4), (count, 1, 1))
    out[:, :3, :3] = Slerp(times, Rotation.from_matrix(T[:, :3, :3]))(grid).as_matrix()
    for axis in range(3):
        out[:, axis, 3] = np.interp(grid, times, T[:, axis, 3])
    valid = np.ones(count, bool)
    for step in np.flatnonzero(broken):
        first = int(np.searchsorted(grid, times[step] + _SAME_TIME))
        last = int(np.searchsorted(grid, times[step + 1] + _SAME_TIME)) - 1
        valid[first : max(first, last) + 1] = False
    return out, valid
