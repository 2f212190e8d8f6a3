"""When something stands still: half a second within 5 mm and one degree, in the mean.

A tracker's noise moves every single pose, so what is judged is a moving average: over one frame in a
quiet log, and over as many as a noisy one needs.
"""

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import uniform_filter1d
from scipy.stats import chi2

from ingest.trajectory.config import RESTS
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

_SIXTH = np.zeros(13)
_SIXTH[::2] = np.array([1.0, -6, 15, -20, 15, -6, 1]) / np.sqrt(924)
"""Sixth difference of every other frame: what is smooth over 0.4 s goes, white noise keeps its size.

Of neighbouring frames it would see little: a pose between two logged ones is their mean.
"""

Poses = Float64[np.ndarray, "frames 3 4"]
"""Rotations and positions side by side."""


def find_rests(
    T: Float64[np.ndarray, "frames 4 4"], valid: Bool[np.ndarray, " frames"]
) -> list[tuple[int, int]]:
    """(start, stop) of the frames at 30 fps in which the origin of T and its axes stand still."""
    width = round(RESTS.shortest * FPS) + 1
    if len(T) < width:
        return []
    noise = frame_noise(T, valid)
    averaged = _frames_to_average(noise)
    mean = _averaged(T[:, :3], valid, averaged)
    windows = np.lib.stride_tricks.sliding_window_view
    still = (
        np.linalg.norm(np.ptp(windows(mean[..., 3], width, axis=0), axis=-1), axis=1)
        < RESTS.largest_spread
    )
    still &= windows(valid, width).all(axis=-1)
    still &= _turns(mean[..., :3], width) < np.radians(RESTS.largest_turn)
    if averaged > 1:
        still &= _is_noise(T[:, :3] - mean, noise, width)
    resting = np.zeros(len(T), bool)
    for start in np.flatnonzero(still):
        resting[start : start + width] = True
    return runs(resting)


def frame_noise(
    T: Float64[np.ndarray, "frames 4 4"], valid: Bool[np.ndarray, " frames"]
) -> tuple[float, float]:
    """Noise from frame to frame on each axis (standard deviation): metres, rad.

    Sixth differences leave what hardly any motion does. The quietest part of the take tells, so brisk
    motion in the rest of it does not count.
    """
    windows = np.lib.stride_tricks.sliding_window_view
    whole = windows(valid, len(_SIXTH)).all(axis=1) if len(T) >= len(_SIXTH) else np.empty(0, bool)
    if not whole.any():
        return 0.0, 0.0
    left = windows(T[:, :3], len(_SIXTH), axis=0)[whole] @ _SIXTH
    share = RESTS.quiet_share
    expected = float(chi2.ppf(share, 3))
    shift = np.quantile((left[..., 3] ** 2).sum(axis=1), share) / expected
    # A small turn by a vector r moves the three columns of a rotation by 2 |r|^2 in all.
    turn = np.quantile((left[..., :3] ** 2).sum(axis=(1, 2)), share) / 2 / expected
    return float(np.sqrt(shift)), float(np.sqrt(turn))


def is_steady(
    T: Float64[np.ndarray, "frames 4 4"], noise: tuple[float, float] = (0.0, 0.0)
) -> bool:
    """Whether a rest is too steady for hands: the thing stands, on the floor or on something else.

    Args:
        T: the poses of the rest.
        noise: of the log, as `frame_noise` has it; it is no trembling.
    """
    shift = np.linalg.norm(T[:, :3, 3].std(axis=0))
    # A small turn moves the three columns of a rotation by sqrt(2) times its angle in all.
    turn = np.linalg.norm(T[:, :3, :3].std(axis=0)) / np.sqrt(2)
    return bool(
        shift < np.hypot(RESTS.steady_shift, RESTS.steady_noise * noise[0])
        and turn < np.hypot(np.radians(RESTS.steady_turn), RESTS.steady_noise * noise[1])
    )


def _frames_to_average(noise: tuple[float, float]) -> int:
    """How many frames bring the noise down to what an average may keep; odd."""
    needed = max(noise[0] / RESTS.kept_noise, noise[1] / np.radians(RESTS.kept_turn_noise)) ** 2
    return int(min(max(1, needed), RESTS.most_averaged)) // 2 * 2 + 1


def _averaged(T: Poses, valid: Bool[np.ndarray, " frames"], count: int) -> Poses:
    """Moving average over so many frames, those that are not valid left out.

    Averages of rotations are a little shorter than rotations: 1 part in 10,000 at 1 degree of noise.
    """
    if count == 1:
        return T
    weight = uniform_filter1d(valid.astype(float), count)[:, None, None].clip(1e-9)
    return uniform_filter1d(np.where(valid[:, None, None], T, 0.0), count, axis=0) / weight


def _is_noise(left: Poses, noise: tuple[float, float], width: int) -> Bool[np.ndarray, " windows"]:
    """Whether what an average took out of each window is no more than the log's noise."""
    windows = np.lib.stride_tricks.sliding_window_view
    shift = np.sqrt(windows((left[..., 3] ** 2).sum(axis=1), width).mean(axis=1) / 3)
    turn = np.sqrt(windows((left[..., :3] ** 2).sum(axis=(1, 2)), width).mean(axis=1) / 6)
    return (shift < np.hypot(RESTS.shaking * noise[0], RESTS.kept_noise)) & (
        turn < np.hypot(RESTS.shaking * noise[1], np.radians(RESTS.kept_turn_noise))
    )


def _turns(R: Float64[np.ndarray, "frames 3 3"], width: int) -> Float64[np.ndarray, " windows"]:
    """Largest angle (rad) between each frame and the width-1 frames after it."""
    count = len(R) - width + 1
    largest = np.zeros(count)
    for k in range(1, width):
        # The chord of two rotations: |A - B|_F = 2 sqrt(2) sin(angle / 2).
        chord = np.linalg.norm(R[k : k + count] - R[:count], axis=(1, 2)) / np.sqrt(8)
        largest = np.maximum(largest, 2 * np.arcsin(np.minimum(chord, 1)))
    return largest
