"""The actor's base motion for one clip: mocap that stops where things are taken or put down."""

from dataclasses import dataclass

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from omomo_core.learning.synthesis.directions import ahead_of
from omomo_core.learning.synthesis.footage import Stretch, heading

_EASE = 5.0
"""Frames (one sigma) over which somebody comes to a stop."""
_PAD = 20
_ON_ITS_WAY = 0.6
"""Least share of the way that must lead ahead (or back) where the actor pushes (or pulls)."""
_LONGEST_IDLE = 75
"""Frames somebody may stand and wait where there is too little mocap around a stop."""


@dataclass(frozen=True)
class BaseMotion:
    """A base motion with the places where the actor stands still."""

    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    sway: Float[np.ndarray, "frames 5"]
    """What nobody can hold still over planted feet: pelvis (metres), lean and twist (radians)."""
    pauses: list[tuple[int, int]]
    """First and one-past-last frame of each stop asked for."""


def motion_with_stops(
    rng: np.random.Generator,
    stretch: Stretch,
    frames: int,
    pause_frames: list[int],
    rates: tuple[float, float] = (0.7, 1.2),
    walk: tuple[int, int] = (24, 10_000),
) -> BaseMotion | None:
    """Lay a stretch of mocap over `frames` frames with a stop of each given length, in this order.

    Args:
        rng: picks the stops, the speed and what comes before and after.
        stretch: the mocap.
        frames: length of the result.
        pause_frames: length of each stop; there is movement between two stops.
        rates: slowest and fastest play of the mocap.
        walk: least and most frames between two stops.

    Returns:
        None where the stretch is too short or has no place to stop.
    """
    rate = rng.uniform(*rates)
    if not pause_frames:
        spare = len(stretch.root) - 1 - frames * rate
        if spare < 0:
            return None
        source = rng.uniform(0, spare) + rate * np.arange(frames)
        return BaseMotion(*sample(stretch, source), sway=idle_sway(rng, frames), pauses=[])
    moving = frames - sum(pause_frames)
    stops = _pick_stops(rng, stretch, rate, len(pause_frames), (walk[0], min(walk[1], moving)))
    if stops is None:
        return None
    outer = moving - (stops[-1] - stops[0]) / rate
    if outer < 0:
        return None
    before, after = stops[0] / rate, (len(stretch.root) - 1 - stops[-1]) / rate
    idle = max(0.0, outer - before - after)
    if idle > _LONGEST_IDLE:
        return None
    idle_before = idle * rng.random()
    earliest, latest = max(0.0, outer - idle - after), min(before, outer - idle)
    lead_in = rng.uniform(earliest, max(earliest, latest))
    source, pauses = _timeline(stops, rate, pause_frames, lead_in, idle_before, idle, frames)
    source = gaussian_filter1d(source.clip(0.0, len(stretch.root) - 1.0), _EASE)[_PAD:-_PAD]
    return BaseMotion(*sample(stretch, source), sway=idle_sway(rng, frames), pauses=pauses)


def goes_its_way(base_motion: BaseMotion, spans: list[tuple[int, int]], way: int) -> bool:
    """Return whether the actor mostly walks ahead (way 1) or backward (-1) in some frames; 0 allows both."""
    ahead = ahead_of(gaussian_filter1d(np.unwrap(heading(base_motion.rotations)), _EASE))
    steps = np.diff(gaussian_filter1d(base_motion.root[:, :2], _EASE, axis=0), axis=0)
    held = np.zeros(len(steps), bool)
    for first, last in spans:
        held[first:last] = True
    along = (steps * ahead[1:]).sum(axis=1)[held]
    far = np.linalg.norm(steps[held], axis=1).sum()
    return bool(way * along.sum() >= _ON_ITS_WAY * abs(way) * far)


def sample(
    stretch: Stretch, source: Float[np.ndarray, " frames"]
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Root and rotations of a stretch at fractional frames."""
    left = np.floor(source).astype(int).clip(0, len(stretch.root) - 2)
    t = source - left
    root = stretch.root[left] * (1 - t[:, None]) + stretch.root[left + 1] * t[:, None]
    first = torch.as_tensor(stretch.rotations[left])
    turn = roma.rotmat_to_rotvec(first.mT @ torch.as_tensor(stretch.rotations[left + 1]))
    step = roma.rotvec_to_rotmat(turn * torch.as_tensor(t)[:, None, None])
    return root, (first @ step).numpy()


def idle_sway(rng: np.random.Generator, frames: int) -> Float[np.ndarray, "frames 5"]:
    """Return the small sway of a standing body, for `BaseMotion.sway`."""
    noise = gaussian_filter1d(rng.normal(size=(frames + 120, 5)), rng.uniform(12, 20), axis=0)
    scale = np.array([0.006, 0.006, 0.002, 0.015, 0.02])
    return noise[60:-60] / max(float(noise.std()), 1e-9) * scale


def _pick_stops(
    rng: np.random.Generator, stretch: Stretch, rate: float, count: int, walk: tuple[int, int]
) -> list[int] | None:
    """Source frames to stop at; better stops are likelier."""
    good = np.flatnonzero(stretch.stops)
    stops: list[int] = []
    for _ in range(count):
        if stops:
            way = (good - stops[-1]) / rate
            good = good[(way >= walk[0]) & (way <= walk[1])]
        if len(good) == 0 or walk[1] < 0:
            return None
        chance = stretch.stops[good] ** 1.5
        stops.append(int(rng.choice(good, p=chance / chance.sum())))
    return stops


def _timeline(
    stops: list[int],
    rate: float,
    pause_frames: list[int],
    lead_in: float,
    idle_before: float,
    idle: float,
    frames: int,
) -> tuple[Float[np.ndarray, " padded"], list[tuple[int, int]]]:
    """Source frame of every output frame (padded at both ends), and the frames of the stops."""
    knots, values = [-_PAD], [stops[0] - (lead_in + _PAD) * rate]
    pauses: list[tuple[int, int]] = []
    at = lead_in
    for k, (stop, pause) in enumerate(zip(stops, pause_frames, strict=True)):
        arrive = at if k == 0 else at + (stop - stops[k - 1]) / rate
        start = arrive + (idle_before if k == 0 else 0.0)
        leave = start + pause + (idle - idle_before if k == len(stops) - 1 else 0.0)
        knots += [arrive, leave]
        values += [stop, stop]
        pauses.append((round(start), round(start + pause)))
        at = leave
    knots.append(frames + _PAD)
    values.append(stops[-1] + (frames + _PAD - at) * rate)
    return np.interp(np.arange(-_PAD, frames + _PAD), knots, values), pauses
