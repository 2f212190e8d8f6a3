"""Quaternions that people and programs write: nearly of length 1, of either sign."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float64

from omomo_core.errors import InputError

_TOLERANCE = 0.02
"""Typed by hand with two decimals they are off by about this."""


def checked(
    xyzw: Float64[np.ndarray, "keys 4"], place: Callable[[int], str]
) -> Float64[np.ndarray, "keys 4"]:
    """The same rotations with length exactly 1, never jumping between q and -q.

    Args:
        xyzw: one quaternion per key.
        place: says where in the file a key is.

    Raises:
        InputError: "quaternion-not-unit" when a length is off by more than 2 %.
    """
    lengths = np.linalg.norm(xyzw, axis=1)
    off = ~(np.abs(lengths - 1) <= _TOLERANCE)
    if off.any():
        key = int(np.argmax(off))
        raise InputError(
            "quaternion-not-unit",
            f"The quaternion has length {lengths[key]:.4g} instead of 1.",
            where=place(key),
            fix="Give rotations as unit quaternions in the order x, y, z, w; 0, 0, 0, 1 is none.",
        )
    return xyzw / lengths[:, None] * signs(xyzw)[:, None]


def signs(xyzw: Float64[np.ndarray, "keys 4"]) -> Float64[np.ndarray, " keys"]:
    """1 or -1 for each, so that neighbours are less than half a turn of the 4-sphere apart."""
    flips = np.where((xyzw[1:] * xyzw[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return np.concatenate([[1.0], np.cumprod(flips)])
