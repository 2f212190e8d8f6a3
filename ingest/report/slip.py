"""Test whether the clamp slipped during a take: rests on one side of the object must agree."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.stats import chi2, norm

from ingest.report.check import Check
from ingest.report.look import Look
from omomo_core.motion import FPS

_SURE = 0.999
"""Of takes whose clamp held, this share passes."""
_LEAN, _WANDER, _UNEVEN = 0.4, 0.3, 0.3
"""Degrees (standard deviation, each axis): of ARKit's world, of its gravity from rest to rest, of floors."""
_HEIGHT = 0.004
_DRIFT = 0.004
"""Metres: of the height of a rest, and of what tracking adds to it per metre of path."""
_SAME_SIDE = 45.0
"""Degrees between two rests on one side of the object."""
_DOUBT = 0.5
"""Seconds by which the time of a slip may fit worse and still be the right one."""
_SHARP = 1.5
"""Seconds within which a slip must be placed to be told as a moment."""
_FIX = (
    "Look at the clamp, then calibrate the mount again; if the object did lean against something, "
    "all is well."
)


@dataclass(frozen=True)
class GroundRest:
    """A stretch in which the object stands on the floor, or on a table, or seems to after a slip."""

    start: int
    stop: int
    """Frames at 30 fps."""
    T_world_object: Float64[np.ndarray, "4 4"]
    """Its mean pose."""
    height: float
    """Of the object's lowest point over the floor, metres."""
    on_floor: bool
    """Whether that is next to nothing."""
    steady: bool
    """Whether it is too still to be held."""
    path: float
    """Metres that the object had gone by then."""


class _Pair(NamedTuple):
    """Two rests on one side, and how much more they differ than they may."""

    first: GroundRest
    second: GroundRest
    tilt: float
    tilt_limit: float
    rise: float
    rise_limit: float

    @property
    def excess(self) -> float:
        return max(self.tilt / self.tilt_limit, self.rise / self.rise_limit)


def slip(look: Look, rests: Sequence[GroundRest]) -> Check:
    """Compare each rest with the last one before it on the same side of the object.

    A slip about the vertical or along the floor changes neither tilt nor height: it does not show.
    """
    pairs = _pairs(rests)
    if not pairs:
        message = "not checked: the object rests on one side of it only once"
        return Check("mount slip", "ok", message)
    worst = max(pairs, key=lambda pair: pair.excess)
    if worst.excess < 1:
        message = (
            f"from rest to rest its tilt differs by {worst.tilt:.1f} deg and its height by "
            f"{100 * worst.rise:.1f} cm (a slip of {worst.tilt_limit:.1f} deg or "
            f"{100 * worst.rise_limit:.0f} cm would show)"
        )
        return Check("mount slip", "ok", message)
    if worst.tilt < worst.tilt_limit:
        return _risen(look, worst)
    start, stop = _when(look, worst)
    if (stop - start) / FPS < _SHARP:
        moment = f"at about {(start + stop) / 2 / FPS:.1f} s"
    else:
        moment = f"between {start / FPS:.1f} and {stop / FPS:.1f} s"
    message = (
        f"its tilt differs by {worst.tilt:.1f} deg from one rest to the next, by gravity's noise and "
        f"floors at most {worst.tilt_limit:.1f}; it changes {moment}"
    )
    return Check("mount slip", "warn", message, look.logged(start, stop), _FIX)


def _risen(look: Look, pair: _Pair) -> Check:
    message = (
        f"its lowest point is {100 * pair.rise:.1f} cm higher or lower in one rest than in the "
        f"last, by drift at most {100 * pair.rise_limit:.1f}"
    )
    frames = look.logged(pair.first.stop - 1, pair.second.start + 1)
    fix = f"{_FIX} It also looks so when the two places are not equally high."
    return Check("mount slip", "warn", message, frames, fix)


def _pairs(rests: Sequence[GroundRest]) -> list[_Pair]:
    found: list[_Pair] = []
    for k, second in enumerate(rests):
        for first in reversed(rests[:k]):
            pair = _pair(first, second)
            if pair.tilt < _SAME_SIDE:
                found.append(pair)
                break
    return found


def _pair(first: GroundRest, second: GroundRest) -> _Pair:
    """How two rests differ, and how far honest ones differ at most."""
    turned = second.T_world_object[:3, :3] @ first.T_world_object[:3, :3].T
    ups = first.T_world_object[2, :3] @ second.T_world_object[2, :3]
    half = np.arctan2(turned[1, 0] - turned[0, 1], turned[0, 0] + turned[1, 1]) / 2
    # A world that leans tilts an object the other way when it has turned round.
    sd = np.sqrt(2 * (_WANDER**2 + _UNEVEN**2) + (2 * _LEAN * np.sin(half)) ** 2)
    apart = np.linalg.norm(second.T_world_object[:2, 3] - first.T_world_object[:2, 3])
    gone = second.path - first.path
    height = np.sqrt(_HEIGHT**2 + (_DRIFT * gone) ** 2 + (np.radians(_LEAN) * apart) ** 2)
    return _Pair(
        first,
        second,
        tilt=float(np.degrees(np.arccos(np.clip(ups, -1, 1)))),
        tilt_limit=float(np.sqrt(chi2.ppf(_SURE, 2)) * sd),
        rise=abs(second.height - first.height) if first.on_floor and second.on_floor else 0.0,
        rise_limit=float(norm.isf((1 - _SURE) / 2) * height),
    )


def _when(look: Look, pair: _Pair) -> tuple[int, int]:
    """(start, stop) of the frames at which the tilt may have gone from that of the one rest to the other's.

    The moment that leaves the least difference from the first rest before it and from the second
    after it; differences count no more than the slip's own, so that tilts of the carry do not matter.
    """
    assert look.take is not None
    first, last = pair.first.stop, pair.second.start
    ups = look.take.motion.T_world_object[first:last, 2, :3]
    ends = [rest.T_world_object[2, :3] for rest in (pair.first, pair.second)]
    most = float(np.linalg.norm(ends[1] - ends[0]))
    before, after = (np.minimum(np.linalg.norm(ups - end, axis=1), most) ** 2 for end in ends)
    left = np.concatenate([[0.0], np.cumsum(before)]) + np.concatenate(
        [np.cumsum(after[::-1])[::-1], [0.0]]
    )
    likely = np.flatnonzero(left <= left.min() + _DOUBT * FPS * most**2)
    return first + int(likely[0]), first + int(likely[-1]) + 1
