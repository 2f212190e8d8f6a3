"""Root paths of people who move things, and the footsteps that follow them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.base_motion import turned_by
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
    """The body's intended place and heading at every frame (30 fps)."""

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


_TURN_AS_SPEED = 0.30
"""Metres per radian: turning on the spot steps as fast as walking at this lever."""
_FORESIGHT = 6
"""Frames: where the body will be in the middle of the swing decides whether a step is due."""
_WORTH = 0.065
"""Metres the foot must be off to be worth a step, and..."""
_YAW_WORTH = 0.36
"""...metres per radian that a twisted foot adds."""
_CLEARANCE = 0.145
"""Metres between the ankles, across, that keep feet from treading on each other."""
_AHEAD, _ASIDE = 0.33, 0.21
"""Metres: farther ahead of (beside, behind) where the body is by then nobody puts a foot down."""
_AHEAD_SLOW, _AHEAD_PACE = 0.10, 0.27
"""Metres, and seconds: nor, while the body is slow, as in the first step of a walk."""
_FORGET = round(1.0 * FPS)
"""Frames of standing after which either foot may start."""


@dataclass(frozen=True)
class Footstep:
    """One step of a foot (0 left, 1 right) and where it is put down."""

    foot: int
    lift: int
    land: int
    place: Float[np.ndarray, " 2"]
    """Ankle, world, metres."""
    yaw: float


@dataclass(frozen=True)
class FootStance:
    """The places of both feet when somebody stands at a path's frame: neutral, or at the start."""

    place: Float[np.ndarray, "frames 2 2"]
    """Ankles, world, metres; left then right."""
    yaw: Float[np.ndarray, "frames 2"]


def neutral_stance(
    path: RootPath,
    apart: Float[np.ndarray, "frames 2 2"],
    yaw: Float[np.ndarray, "frames 2"],
) -> FootStance:
    """Feet under the body at every frame, from their places in the frame of the body."""
    turned = turned_by(path.heading[:, None], apart)
    return FootStance(path.position[:, None] + turned, path.heading[:, None] + yaw)


def both_down(speed: float) -> float:
    """Seconds both feet are down between two steps, by the speed in m/s."""
    return max(0.07, 0.22 - 0.14 * speed)


def in_the_air(size: float) -> int:
    """Frames a foot is in the air for a step of so many metres: as steps in the mocap."""
    return round(min(8.5 + 10.0 * size, 13.0))


def plan_steps(
    rng: np.random.Generator, path: RootPath, neutral: FootStance, dwell: float
) -> list[Footstep]:
    """Alternate the feet, each put down where the body will be halfway through its stance.

    Args:
        rng: picks the first foot where either would do.
        path: of the pelvis.
        neutral: the feet under the body at every frame; they start so.
        dwell: factor on the time on both feet between steps.
    """
    planner = _Planner(rng, path, neutral, dwell)
    frame = 0
    while frame < len(path.heading):
        frame = planner.advance(frame)
    return planner.steps


class _Planner:
    def __init__(
        self, rng: np.random.Generator, path: RootPath, neutral: FootStance, dwell: float
    ) -> None:
        self.steps: list[Footstep] = []
        self._rng, self._neutral, self._dwell = rng, neutral, dwell
        velocity = np.gradient(path.position, axis=0) * FPS
        self._heading = path.heading
        self._velocity = velocity
        self._turning = np.gradient(path.heading) * FPS
        self._pace = np.linalg.norm(velocity, axis=1) + _TURN_AS_SPEED * np.abs(self._turning)
        self._place = neutral.place[0].copy()
        self._yaw = neutral.yaw[0].copy()

    def advance(self, frame: int) -> int:
        """Take a step at this frame if one is due; the next frame at which to look."""
        ahead = float(self._pace[frame : frame + round(0.5 * FPS)].mean())
        both = max(2, round(both_down(ahead) * self._dwell * FPS))
        due = [foot for foot in (0, 1) if self._off(foot, frame + _FORESIGHT) > _WORTH]
        foot = self._choose(due, frame)
        if foot is None:
            return frame + 1
        swing = in_the_air(float(ahead) * 2 * (both + 12) / FPS)
        place, yaw = self._aim(foot, frame + swing, swing + 2 * both)
        size = float(np.linalg.norm(place - self._place[foot]))
        size += _YAW_WORTH * abs(yaw - self._yaw[foot])
        if size < _WORTH * 0.7:
            return frame + 1
        swing = in_the_air(size)
        self.steps.append(Footstep(foot, frame, frame + swing, place, yaw))
        self._place[foot], self._yaw[foot] = place, yaw
        return frame + swing + both

    def _off(self, foot: int, frame: int) -> float:
        at = min(frame, len(self._pace) - 1)
        gap = np.linalg.norm(self._neutral.place[at, foot] - self._place[foot])
        return float(gap + _YAW_WORTH * abs(self._neutral.yaw[at, foot] - self._yaw[foot]))

    def _choose(self, due: list[int], frame: int) -> int | None:
        if not due:
            return None
        last = self.steps[-1] if self.steps else None
        resting = last is None or frame - last.land > _FORGET
        if not resting and last is not None:
            other = 1 - last.foot
            if other in due:
                return other
            # The same foot again only as a correction, after the body has settled.
            return last.foot if frame - last.land > 0.3 * FPS else None
        return self._first(due, frame)

    def _first(self, due: list[int], frame: int) -> int:
        """Sideways and in turns the foot on that side goes first; ahead either may."""
        soon = slice(frame, frame + round(0.6 * FPS))
        heading = self._heading[min(frame, len(self._heading) - 1)]
        left = np.array([-np.sin(heading), np.cos(heading)])
        across = float((self._velocity[soon] @ left).mean())
        across += 0.25 * float(self._turning[soon].mean())
        if abs(across) > 0.06:
            return 0 if across > 0 else 1
        return int(self._rng.choice(due))

    def _aim(self, foot: int, land: int, stance: int) -> tuple[Float[np.ndarray, " 2"], float]:
        """Return the place at which the foot should be put, clear of the other one."""
        land = min(land, len(self._pace) - 1)
        at = min(land + stance // 2, len(self._pace) - 1)
        under, yaw = self._neutral.place[land, foot], float(self._neutral.yaw[at, foot])
        ahead = self._neutral.place[at, foot] - under
        heading = self._heading[land]
        forward = float(ahead @ [np.cos(heading), np.sin(heading)])
        size = max(float(np.linalg.norm(ahead)), 1e-9)
        limit = _ASIDE + (_AHEAD - _ASIDE) * max(forward / size, 0.0)
        limit = min(limit, _AHEAD_SLOW + _AHEAD_PACE * float(self._pace[land]))
        place = under + ahead * min(1.0, limit / size)
        outward = 1.0 if foot == 0 else -1.0
        for facing in (heading, self._yaw[1 - foot]):
            side = np.array([-np.sin(facing), np.cos(facing)]) * outward
            across = float((place - self._place[1 - foot]) @ side)
            place += max(0.0, _CLEARANCE - across) * side
        return place, yaw
