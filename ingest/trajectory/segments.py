"""The usable stretches of a motion."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from ingest.trajectory.config import BREAKS
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS, ObjectMotion


def segments(motion: ObjectMotion) -> list[tuple[int, int]]:
    """(start, stop) of each run of valid frames that lasts at least a second."""
    return [(a, b) for a, b in runs(motion.valid) if b - a >= BREAKS.shortest_segment * FPS]


def within(stretches: list[tuple[int, int]], count: int) -> Bool[np.ndarray, " frames"]:
    """Which of `count` frames lie in one of the stretches."""
    mask = np.zeros(count, bool)
    for start, stop in stretches:
        mask[start:stop] = True
    return mask


def choose(stretches: Sequence[tuple[int, int]], wanted: int | None, where: str) -> int:
    """Which stretch is used, counted from 0: the wanted one, or the first of the longest.

    Args:
        stretches: (start, stop) of each, at least one.
        wanted: counted from 1; None takes the longest.
        where: what they are stretches of, for messages.

    Raises:
        InputError: "segment-missing".
    """
    if wanted is None:
        return int(np.argmax([stop - start for start, stop in stretches]))
    if not 1 <= wanted <= len(stretches):
        raise InputError(
            "segment-missing",
            f"There is no segment {wanted}: the take has {len(stretches)}.",
            where=where,
            fix=f"Give --segment a number from 1 to {len(stretches)}, or leave it out for the longest.",
        )
    return wanted - 1


def cut(motion: ObjectMotion, start: int, stop: int) -> ObjectMotion:
    """Frames start to stop of a motion, in the same world."""
    return replace(
        motion,
        T_world_object=motion.T_world_object[start:stop],
        valid=motion.valid[start:stop],
        start_time=motion.start_time + start / FPS,
    )
