"""The usable stretches of a motion."""

from dataclasses import replace

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS, ObjectMotion

MIN_SECONDS = 1.0


def segments(motion: ObjectMotion) -> list[tuple[int, int]]:
    """(start, stop) of each run of valid frames that lasts at least a second."""
    return [(a, b) for a, b in runs(motion.valid) if b - a >= MIN_SECONDS * FPS]


def cut(motion: ObjectMotion, start: int, stop: int) -> ObjectMotion:
    """Frames start to stop of a motion, in the same world."""
    return replace(
        motion,
        T_world_object=motion.T_world_object[start:stop],
        valid=motion.valid[start:stop],
        start_time=motion.start_time + start / FPS,
    )
