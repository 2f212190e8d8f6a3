"""Motions that are recorded or baked pose by pose, resampled at 30 fps."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64

from ingest.animated.animation import Animation, Up, frame_times
from ingest.trajectory.resample import resample


def sampled(
    source: Path,
    times: Float64[np.ndarray, " poses"],
    T: Float64[np.ndarray, "poses 4 4"],
    up: Up,
    gaps: Bool[np.ndarray, " steps"] | None = None,
) -> Animation:
    """Poses at 30 fps by timestamp: linear position, spherical rotation.

    Args:
        source: the file.
        times: seconds, strictly increasing, at least two.
        T: rigid poses in the file's world, metres.
        up: the world's axis that points up.
        gaps: marks the steps between poses that must not be bridged.
    """
    frame_times(float(times[0]), float(times[-1]), source)
    broken = np.zeros(len(times) - 1, bool) if gaps is None else gaps
    frames, valid = resample(times, T, broken)
    return Animation(source, frames, valid, up)
