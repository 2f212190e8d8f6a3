"""Runs of bit-identical poses: a live tracker never repeats itself, so it had lost the room."""

import numpy as np
from jaxtyping import Bool, Float64

from ingest.trajectory.config import FROZEN
from ingest.trajectory.jumps import velocities
from omomo_core.geometry.runs import runs


def repeated_runs(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> list[tuple[int, int]]:
    """First and last pose of each run of equal poses that lasts 0.25 s or more."""
    same = (np.diff(T, axis=0) == 0).all(axis=(1, 2))
    return [(a, b) for a, b in runs(same) if times[b] - times[a] >= FROZEN.shortest]


def find_frozen(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> Bool[np.ndarray, " steps"]:
    """Mark the steps of repeated runs that start or end in full motion, and the step out of them.

    A run that the phone eases into and out of is an object standing still in a log without noise
    (a synthetic one): it stays.
    """
    frozen = np.zeros(len(T) - 1, bool)
    repeated = repeated_runs(times, T)
    if not repeated:
        return frozen
    linear, angular = velocities(T, np.diff(times)[:, None])
    abrupt = (np.linalg.norm(linear, axis=1) > FROZEN.abrupt_speed) | (
        np.linalg.norm(angular, axis=1) > FROZEN.abrupt_turn
    )
    for first, last in repeated:
        borders = [step for step in (first - 1, last) if 0 <= step < len(frozen)]
        if abrupt[borders].any():
            frozen[first : last + 1] = True
    return frozen
