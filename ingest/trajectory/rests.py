"""When something stands still: half a second within 5 mm and one degree."""

import numpy as np
from jaxtyping import Bool, Float64, Int

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

MIN_SECONDS = 0.5
MAX_SPREAD = 0.005
MAX_TURN = np.radians(1.0)
_STEADY, _STEADY_TURN = 0.0015, np.radians(0.25)
"""Metres and rad (standard deviation) of a phone on a thing that nobody holds; hands tremble more."""


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
    still &= windows(valid, width).all(axis=-1)
    starts = np.flatnonzero(still)
    starts = starts[_turn_within(T[:, :3, :3], starts, width) < MAX_TURN]
    resting = np.zeros(len(T), bool)
    for k in range(width):
        resting[starts + k] = True
    return runs(resting)


def is_steady(T: Float64[np.ndarray, "frames 4 4"]) -> bool:
    """Whether a rest is too steady for hands: the thing stands, on the floor or on something else."""
    shift = np.linalg.norm(T[:, :3, 3].std(axis=0))
    # A small turn moves the three columns of a rotation by sqrt(2) times its angle in all.
    turn = np.linalg.norm(T[:, :3, :3].std(axis=0)) / np.sqrt(2)
    return bool(shift < _STEADY and turn < _STEADY_TURN)


def _turn_within(
    R: Float64[np.ndarray, "frames 3 3"], starts: Int[np.ndarray, " windows"], width: int
) -> Float64[np.ndarray, " windows"]:
    """Largest angle (rad) between each of these frames and the width-1 frames after it."""
    largest = np.zeros(len(starts))
    for k in range(1, width):
        # The chord of two rotations: |A - B|_F = 2 sqrt(2) sin(angle / 2).
        chord = np.linalg.norm(R[starts + k] - R[starts], axis=(1, 2)) / np.sqrt(8)
        largest = np.maximum(largest, 2 * np.arcsin(np.minimum(chord, 1)))
    return largest
