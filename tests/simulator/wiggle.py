"""Motions of an object in someone's hands for calibrating its mount, and those that do not suffice."""

from typing import Literal

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import HEIGHT, box_mesh
from omomo_core.motion import FPS, ObjectMotion

Wiggle = Literal["all axes", "yaw", "translation", "tiny"]

_TURNS: dict[Wiggle, tuple[float, float, float]] = {
    "all axes": (35.0, 30.0, 50.0),
    "yaw": (0.0, 0.0, 70.0),
    "translation": (0.0, 0.0, 0.0),
    "tiny": (2.0, 2.0, 2.0),
}
"""Largest turns about the object's x and y and about the vertical, degrees."""
_REACH = (0.20, 0.20, 0.12)
"""Largest shifts, metres."""
_RATES = (0.31, 0.23, 0.41)
"""Hz: no two in step, so that the motion does not repeat."""
_LIFTED = 0.9
_EASE = 1.0
"""Seconds from rest into the motion, and out of it."""


def wiggle_motion(
    kind: Wiggle = "all axes", *, seconds: float = 20.0, seed: int = 0
) -> ObjectMotion:
    """A box turned and moved on the spot, at rest at both ends, 30 fps.

    Args:
        kind: "all axes" calibrates everything; "yaw" is pushing it about on the floor; "translation"
            never turns; "tiny" turns by two degrees.
        seconds: how long.
        seed: of phases and rates: each gives another motion.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(round(seconds * FPS)) / FPS
    ease = np.clip(np.minimum(times, times[-1] - times) / _EASE, 0, 1)
    ease = ease**3 * (10 - 15 * ease + 6 * ease**2)
    swing = _waves(times, rng) * ease[:, None]
    turns = np.radians(_TURNS[kind]) * swing[:, :3]
    shift = np.array(_REACH) * swing[:, 3:]
    on_floor = kind == "yaw"
    T = np.tile(np.eye(4), (len(times), 1, 1))
    yaw = Rotation.from_euler("z", turns[:, 2:])
    T[:, :3, :3] = (yaw * Rotation.from_euler("xy", turns[:, :2])).as_matrix()
    T[:, :3, 3] = shift * [1, 1, 0 if on_floor else 1]
    T[:, 2, 3] += HEIGHT / 2 if on_floor else _LIFTED
    return ObjectMotion(box_mesh(), T, np.ones(len(times), bool))


def _waves(
    times: Float64[np.ndarray, " frames"], rng: np.random.Generator
) -> Float64[np.ndarray, "frames 6"]:
    """Six smooth signals within -1 and 1 that have nothing to do with each other."""
    rates = np.concatenate([_RATES, np.roll(_RATES, 1)]) * rng.uniform(0.8, 1.25, 6)
    slow = np.sin(2 * np.pi * (np.outer(times, rates) + rng.random(6)))
    fast = np.sin(2 * np.pi * (np.outer(times, 1.7 * rates) + rng.random(6)))
    return 0.75 * slow + 0.25 * fast
