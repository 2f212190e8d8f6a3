"""Keyframes of one object, and its poses between them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64

from ingest.animated.animation import Animation, Up, frame_times
from ingest.animated.curves import Mode, evaluate
from ingest.animated.poses import check_times, rigid
from ingest.animated.quaternions import checked, signs
from omomo_core.errors import InputError


@dataclass(frozen=True)
class Keyframes:
    """Poses at some times, and how they are interpolated."""

    source: Path
    times: Float64[np.ndarray, " keys"]
    """Seconds."""
    positions: Float64[np.ndarray, "keys 3"]
    xyzw: Float64[np.ndarray, "keys 4"]
    modes: tuple[Mode, ...]
    """How the motion goes on from each key."""
    up: Up
    places: tuple[str, ...]
    """Where each key is in the file, for messages."""
    handles: Float64[np.ndarray, "keys 7 2 2"] | None = None
    """(time, value) of the left and right Bezier handle of x, y, z, qx, qy, qz, qw."""


def animate(keys: Keyframes) -> Animation:
    """The motion as Blender plays it: each of the seven numbers along its own curve.

    Raises:
        InputError: "animation-one-key", "time-backwards", "quaternion-not-unit",
            "quaternion-vanishes" or "animation-long".
    """
    place = keys.places.__getitem__
    check_times(keys.times, place, keys.source)
    xyzw = checked(keys.xyzw, place)
    values = np.concatenate([keys.positions, xyzw], axis=1)
    handles = _turned(keys)
    at = frame_times(float(keys.times[0]), float(keys.times[-1]), keys.source)
    curves = [
        evaluate(
            keys.times, values[:, c], keys.modes, None if handles is None else handles[:, c], at
        )
        for c in range(7)
    ]
    sampled = np.stack(curves, axis=1)
    _check_rotations(sampled[:, 3:], at, keys.source)
    T = rigid(sampled[:, :3], sampled[:, 3:])
    return Animation(keys.source, T, _all_valid(T), keys.up)


def _turned(keys: Keyframes) -> Float64[np.ndarray, "keys 7 2 2"] | None:
    """The handles with those of quaternions whose sign was changed."""
    if keys.handles is None:
        return None
    handles = keys.handles.copy()
    handles[:, 3:, :, 1] *= signs(keys.xyzw)[:, None, None]
    return handles


def _check_rotations(
    xyzw: Float64[np.ndarray, "frames 4"], at: Float64[np.ndarray, " frames"], source: Path
) -> None:
    gone = np.linalg.norm(xyzw, axis=1) < 1e-3
    if gone.any():
        raise InputError(
            "quaternion-vanishes",
            f"Between two keys, at {at[np.argmax(gone)]:.2f} s, the quaternion shrinks to nothing.",
            where=str(source),
            fix="Put another key between them, or leave out the handles of the quaternion.",
        )


def _all_valid(T: Float64[np.ndarray, "frames 4 4"]) -> Bool[np.ndarray, " frames"]:
    return np.ones(len(T), bool)
