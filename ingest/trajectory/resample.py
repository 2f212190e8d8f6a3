"""Poses at 30 fps by timestamp: linear position, spherical rotation, nothing across a break."""

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation, Slerp

from omomo_core.motion import FPS

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
