"""Animation: an object's own motion, as a file has it, at 30 fps."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from omomo_core.errors import InputError
from omomo_core.motion import FPS, ObjectMesh

Up = Literal["y", "z"]

MAX_SECONDS, MAX_FPS = 3600.0, 10_000.0
_SAME_TIME = 1e-3
"""Of a frame; files keep times in single precision."""


@dataclass(frozen=True)
class Animation:
    """Rigid poses of one object in the axes and the world of its file, metres."""

    source: Path
    T_file_object: Float64[np.ndarray, "frames 4 4"]
    """Maps the mesh's coordinates, as its own file has them, into the file's world."""
    valid: Bool[np.ndarray, " frames"]
    """False in the gaps of a recorded motion."""
    up: Up
    """Which axis of the file's world points up."""
    mesh: ObjectMesh | None = None
    """The object's surface, where the file holds one."""


def frame_times(first: float, last: float, source: Path) -> Float64[np.ndarray, " frames"]:
    """Every 1/30 s from the first to the last time (seconds).

    Raises:
        InputError: "animation-long" for more than an hour: the times are in another unit.
    """
    if last - first > MAX_SECONDS:
        raise InputError(
            "animation-long",
            f"The animation lasts {last - first:,.0f} s; at most {MAX_SECONDS:,.0f} s are read.",
            where=str(source),
            fix="Give times in seconds (not milliseconds), and the scene's frame rate.",
        )
    count = int((last - first) * FPS + _SAME_TIME) + 1
    return np.minimum(first + np.arange(count) / FPS, last)
