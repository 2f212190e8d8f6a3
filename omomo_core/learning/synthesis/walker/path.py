"""Root paths as people take who move things: short moves in any direction, and stops."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.directions import turned_by
from omomo_core.motion import FPS

_START, _START_PER_SPEED = 0.3, 0.35
"""Seconds to get going and to come to rest again, more for faster moves (seconds per m/s)."""
_FASTEST_TURN = 1.4
"""Radians per second, on average over a move."""

MoveName = Literal["walk", "back", "side", "shuffle", "turn", "orbit"]
Chances = Mapping[MoveName, float]
CHANCES: Chances = {
    "walk": 0.32, "back": 0.14, "side": 0.13, "shuffle": 0.19, "turn": 0.12, "orbit": 0.10,
}  # fmt: skip


@dataclass(frozen=True)
class RootPath:
    """Where the body should be, and face, at every frame (30 fps)."""

    position: Float[np.ndarray, "frames 2"]
    """World, metres."""
    heading: Float[np.ndarray, " frames"]
    """Yaw about world z, unwrapped, radians."""


@dataclass(frozen=True)
class Move:
    """One movement from rest to rest, in the frame of the body: x forward, y left."""

    name: MoveName
    shift: tuple[float, float]
    """Metres along x and y, measured along the (curved) path."""
    turn: float
    """Radians, positive to the left."""
    frames: int
    turning: tuple[float, float] = (0.0, 1.0)
    """Which part of the time the turn takes."""


def draw_move(rng: np.random.Generator, chances: Chances = CHANCES) -> Move:
    """A random move, of a kind that is picked by its chance."""
    name = _pick(rng, chances)
    side = float(rng.choice([-1.0, 1.0]))
    if name == "walk":
        forward = rng.uniform(0.6, 3.6)
        turn = rng.normal(0.0, 0.5) * min(1.0, forward / 1.5)
        start = rng.uniform(0.0, 0.4)
        window = (start, rng.uniform(start + 0.4, 1.0))
        return _move(name, (forward, 0.0), turn, rng.uniform(0.5, 1.25), window)
    if name == "back":
        shift = (-rng.uniform(0.25, 2.0), rng.normal(0.0, 0.1))
        return _move(name, shift, rng.normal(0.0, 0.25), rng.uniform(0.25, 0.7))
    if name == "side":
        shift = (rng.normal(0.0, 0.12), side * rng.uniform(0.25, 1.6))
        return _move(name, shift, rng.normal(0.0, 0.2), rng.uniform(0.2, 0.55))
    if name == "shuffle":
        way = rng.uniform(-np.pi, np.pi)
        far = rng.uniform(0.15, 0.55)
        shift = (far * np.cos(way), far * np.sin(way))
        return _move(name, shift, rng.normal(0.0, 0.4), rng.uniform(0.18, 0.5))
    if name == "orbit":
        # Around a thing ahead: facing it all the while means going sideways on a circle.
        turn = side * rng.uniform(0.4, 1.9)
        shift = (rng.normal(0.0, 0.08), -turn * rng.uniform(0.4, 0.8))
        return _move(name, shift, turn, rng.uniform(0.25, 0.9))
    turn = side * rng.uniform(0.5, np.pi)
    shift = (rng.normal(0.0, 0.08), rng.normal(0.0, 0.08))
    frames = round((abs(turn) / rng.uniform(0.8, 1.6) + _START) * FPS)
    return Move(name, shift, turn, frames)


def _pick(rng: np.random.Generator, chances: Chances) -> MoveName:
    names = list(chances)
    share = np.array([chances[name] for name in names])
    return names[int(rng.choice(len(names), p=share / share.sum()))]


def _move(
    name: MoveName,
    shift: tuple[float, float],
    turn: float,
    speed: float,
    turning: tuple[float, float] = (0.0, 1.0),
) -> Move:
    seconds = max(float(np.hypot(*shift)) / speed, abs(turn) / _FASTEST_TURN) + _settling(speed)
    return Move(name, shift, turn, max(round(seconds * FPS), 15), turning)


def lay(
    parts: list[Move | int], start: tuple[float, float] = (0.0, 0.0), yaw: float = 0.0
) -> RootPath:
    """String moves and standing still (a number of frames) together into a path.

    Args:
        parts: in their order.
        start: where the path starts, world, metres.
        yaw: heading at its start, radians.
    """
    velocity: list[Float[np.ndarray, "frames 2"]] = []
    rate: list[Float[np.ndarray, " frames"]] = []
    for part in parts:
        if isinstance(part, int):
            velocity.append(np.zeros((part, 2)))
            rate.append(np.zeros(part))
        else:
            ramp = _settling(float(np.hypot(*part.shift)) * FPS / part.frames) * FPS / part.frames
            share = _shares(part.frames, ramp, 0.0, 1.0)
            velocity.append(share[:, None] * np.array(part.shift))
            rate.append(_shares(part.frames, ramp, *part.turning) * part.turn)
    turned = np.concatenate(rate)
    heading = yaw + np.cumsum(turned)
    middle = heading - turned / 2
    world = turned_by(middle, np.concatenate(velocity))
    return RootPath(np.array(start) + np.cumsum(world, axis=0), heading)


def _settling(speed: float) -> float:
    return _START + _START_PER_SPEED * speed


def _shares(frames: int, ramp: float, first: float, last: float) -> Float[np.ndarray, " frames"]:
    """Which share of a move happens in each frame: smoothly up, steady, smoothly down; sum 1."""
    t = (np.arange(frames) + 0.5) / frames
    ramp = min(ramp, (last - first) / 2)
    rise = np.minimum((t - first) / ramp, (last - t) / ramp).clip(0.0, 1.0)
    share = rise * rise * (3 - 2 * rise)
    return share / share.sum()
