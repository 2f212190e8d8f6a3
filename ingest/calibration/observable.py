"""Observable directions of a mount, and sentences for those that a recording leaves open."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.calibration.average import LEVER

OPEN_M = 0.03
"""A direction whose standard deviation is more than this, metres (or its angle at LEVER), is open."""
TILT_IT = (
    "Pushing on the floor leaves the height free: fix it by the floor (omocap calibrate floor), or "
    "tilt the object by 20 degrees in two directions while recording."
)


@dataclass(frozen=True)
class OpenDirection:
    """One way in which the mount could be another and the recording look the same."""

    words: str
    step: Float64[np.ndarray, "6"]
    """Rotation vector and translation in the phone's axes; of length 1 with turns at LEVER."""
    sd: float
    """Metres."""


def open_directions(
    covariance: Float64[np.ndarray, "6 6"],
    vertical: Float64[np.ndarray, "3"] | None = None,
) -> tuple[OpenDirection, ...]:
    """The directions of a mount's covariance that are as good as unknown, the widest first.

    Args:
        covariance: rotation (rad) and translation (m) in the phone's axes.
        vertical: unit vector in the phone's axes that stayed upright through the recording, if any.
    """
    scale = np.array([LEVER] * 3 + [1.0] * 3)
    values, vectors = np.linalg.eigh(covariance * np.outer(scale, scale))
    return tuple(
        OpenDirection(_words(vectors[:, k], vertical), vectors[:, k] / scale, float(np.sqrt(value)))
        for k, value in reversed(list(enumerate(values.clip(0))))
        if value > OPEN_M**2
    )


def _words(vector: Float64[np.ndarray, "6"], vertical: Float64[np.ndarray, "3"] | None) -> str:
    turn, shift = vector[:3], vector[3:]
    if np.linalg.norm(turn) > np.linalg.norm(shift):
        return f"the turn about {_axis(turn, vertical)}"
    if vertical is not None and abs(shift @ vertical) > 0.8 * np.linalg.norm(shift):
        return "the height of the object"
    return f"the place of the object along {_axis(shift, vertical)}"


def _axis(vector: Float64[np.ndarray, "3"], vertical: Float64[np.ndarray, "3"] | None) -> str:
    """The nearest of the directions that a person knows."""
    unit = vector / np.linalg.norm(vector)
    if vertical is not None and abs(unit @ vertical) > 0.8:
        return "the vertical"
    names = ("the camera's x (right)", "the camera's y (up)", "the camera's z (the way it looks)")
    nearest = int(np.argmax(np.abs(unit)))
    if abs(unit[nearest]) > 0.9:
        return names[nearest]
    return f"({', '.join(f'{x:.2f}' for x in unit)}) in the camera's axes"
