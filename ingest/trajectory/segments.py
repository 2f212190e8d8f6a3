"""The usable stretches of a motion."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS, ObjectMotion

MIN_SECONDS = 1.0


def segments(motion: ObjectMotion) -> list[tuple[int, int]]:
    """(start, stop) of each run of valid frames that lasts at least a second."""
    return [(a, b) for a, b in runs(motion.valid) if b - a >= MIN_SECONDS * FPS]


def within(stretches: list[tuple[int, int]], count: int) -> Bool[np.ndarray, " frames"]:
    """Which of `count` frames lie in one of the stretches."""
    mask = np.zeros(count, bool)
    for start, stop in stretches:
        mask[start:stop] = True
    return mask


def cut(motion: ObjectMotion, start: int, stop: int) -> ObjectMotion:
    """Frames start to stop of a motion, in the same world."""
    return replace(
        motion,
        T_world_object=motion.T_world_object[start:stop],
        valid=motion.valid[start:stop],
        start_time=motion.start_time + start / FPS,
    )
