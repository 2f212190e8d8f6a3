"""When something stands still: half a second within 5 mm and one degree."""

import numpy as np
from jaxtyping import Bool, Float64

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

MIN_SECONDS = 0.5
MAX_SPREAD = 0.005
MAX_TURN = np.radians(1.0)


def find_rests(
    T: Float64[np.ndarray, "frames 4 4"], valid: Bool[np.ndarray, " frames"]
) -> list[tuple[int, int]]:
    """(start, stop) of the frames at 30 fps in which the origin of T and its axes stand still."""
    width = round(MIN_SECONDS * FPS) + 1
    if len(T) < width:
        return []
    windows = np.lib.stride_tricks.sliding_window_view
    position = windows(T[:, :3, 3], width, axis=0)
    still = np.linalg.norm(np.ptp(position, axis=-1), axis=1) < MAX_SPREAD
    still &= _turn_within(T[:, :3, :3], width) < MAX_TURN
    still &= windows(valid, width).all(axis=-1)
    resting = np.zeros(len(T), bool)
    for start in np.flatnonzero(still):
        resting[start : start + width] = True
    return runs(resting)


def _turn_within(
    R: Float64[np.ndarray, "frames 3 3"], width: int
) -> Float64[np.ndarray, " windows"]:
    """Largest angle (rad) between each frame and the width-1 frames after it."""
    count = len(R) - width + 1
    first, largest = R[:count], np.zeros(count)
    for k in range(1, width):
        # The chord of two rotations: |A - B|_F = 2 sqrt(2) sin(angle / 2).
        chord = np.linalg.norm(R[k : k + count] - first, axis=(1, 2)) / np.sqrt(8)
        largest = np.maximum(largest, 2 * np.arcsin(np.minimum(chord, 1)))
    return largest
