"""Poses from positions and quaternions, and times that must run forwards."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError


def rigid(
    positions: Float64[np.ndarray, "keys 3"], xyzw: Float64[np.ndarray, "keys 4"]
) -> Float64[np.ndarray, "keys 4 4"]:
    """Transforms of positions and quaternions (any length but 0)."""
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(xyzw).as_matrix()
    T[:, :3, 3] = positions
    return T


def check_times(
    times: Float64[np.ndarray, " keys"], place: Callable[[int], str], source: Path
) -> None:
    """Refuse fewer than two keys, and times (seconds) that do not advance.

    Raises:
        InputError: "animation-one-key", or "time-backwards" naming the key.
    """
    if len(times) < 2:
        raise InputError(
            "animation-one-key",
            f"{source.name} has {len(times)} pose{'' if len(times) == 1 else 's'}: nothing moves.",
            where=str(source),
            fix="Give at least two, a second or more apart.",
        )
    stops = np.diff(times) <= 0
    if stops.any():
        key = int(np.argmax(stops))
        raise InputError(
            "time-backwards",
            f"Time does not advance: it goes from {times[key]:.6g} s to {times[key + 1]:.6g} s.",
            where=place(key + 1),
            fix="Give the keys in the order of their times, one for each time.",
        )
