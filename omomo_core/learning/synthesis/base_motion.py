"""The actor's base motion: stretches of mocap that stop where things are taken or left."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.clips import Clip
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS

_SHORTEST = round(1.5 * FPS)
_LONGEST_SHARE = 25 * FPS
"""A take counts as if it were at most so long, such that one person does not fill everything."""
_FASTEST = 2.0
_FASTEST_JOINT = 15.0
"""Radians per second; more is a glitch of the recording, or a fight."""
_STRIDE = 0.48
"""Metres between the ankles; in a longer step nobody stops to lift something."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of a mocap clip."""

    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    stops: Float[np.ndarray, " frames"]
    """How well one could stop at a frame: 0 not at all (feet in the air), 1 is standing still."""
    name: str
    licence: str


@dataclass(frozen=True)
class Footage:
    """All usable stretches with the chance of each to be picked."""

    stretches: list[Stretch]
    chances: Float[np.ndarray, " stretches"]


def survey(clips: Sequence[Clip], body: BodyModel) -> Footage:
    """Find the stretches of walking, turning, standing, bending: nothing airborne or wild."""
    stretches: list[Stretch] = []
    for clip in clips:
        joints = joints_of(body, clip.root, clip.rotations)
        stops = _stops(clip, joints)
        for first, last in runs(_calm(clip, joints)):
            if last - first >= _SHORTEST:
                part = slice(first, last)
                name = f"{clip.name}[{first}:{last}]"
                root, rotations = clip.root[part].astype(float), clip.rotations[part].astype(float)
                stretches.append(Stretch(root, rotations, stops[part], name, clip.licence))
    lengths = np.array([min(len(s.root), _LONGEST_SHARE) for s in stretches], float)
    return Footage(stretches, lengths / max(lengths.sum(), 1.0))


def mirrored(stretch: Stretch) -> Stretch:
    """Left and right exchanged."""
    swap = [BODY_JOINTS.index(_other_side(name)) for name in BODY_JOINTS]
    across_world, across_body = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, 1.0])
    return Stretch(
        root=stretch.root @ across_world,
        rotations=across_world @ stretch.rotations[:, swap] @ across_body,
        stops=stretch.stops,
        name=f"{stretch.name} mirrored",
        licence=stretch.licence,
    )


def reversed_in_time(stretch: Stretch) -> Stretch:
    """Walking forward becomes walking backward."""
    return Stretch(
        root=stretch.root[::-1],
        rotations=stretch.rotations[::-1],
        stops=stretch.stops[::-1],
        name=f"{stretch.name} reversed",
        licence=stretch.licence,
    )


def heading(rotations: Float[np.ndarray, "frames 22 3 3"]) -> Float[np.ndarray, " frames"]:
    """Yaw of the pelvis' forward direction about world z, unwrapped, radians."""
    forward = rotations[:, 0, :, 2]
    return np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))


def _other_side(name: str) -> str:
    if name.startswith("left_"):
        return name.replace("left_", "right_")
    return name.replace("right_", "left_")


def _calm(clip: Clip, joints: Float[np.ndarray, "frames 24 3"]) -> Bool[np.ndarray, " frames"]:
    velocity = np.gradient(gaussian_filter1d(clip.root, 2.0, axis=0), 1 / FPS, axis=0)
    turning = np.gradient(gaussian_filter1d(heading(clip.rotations), 2.0), 1 / FPS)
    standing = maximum_filter1d(clip.foot_contact.max(axis=1), 9) > 0
    calm = (np.linalg.norm(velocity[:, :2], axis=-1) < _FASTEST) & (np.abs(velocity[:, 2]) < 0.7)
    upright = (clip.rotations[:, 0, 2, 1] > 0.75) & (clip.rotations[:, 9, 2, 1] > 0.7)
    turns = np.swapaxes(clip.rotations[:-1], -1, -2) @ clip.rotations[1:]
    cosine = (np.trace(turns, axis1=-2, axis2=-1).min(axis=1, initial=3.0) - 1) / 2
    smooth = np.append(cosine > np.cos(_FASTEST_JOINT / FPS), True)
    # Nobody waves the arms about while handling things.
    low = joints[:, 20:22, 2].max(axis=1) < joints[:, 9, 2]
    return (
        low & calm & smooth & standing & upright & (np.abs(turning) < 4.0) & (clip.root[:, 2] > 0.6)
    )


def _stops(clip: Clip, joints: Float[np.ndarray, "frames 24 3"]) -> Float[np.ndarray, " frames"]:
    planted = clip.foot_contact > 0
    both = (planted[:, 0] | planted[:, 2]) & (planted[:, 1] | planted[:, 3])
    stride = np.linalg.norm(joints[:, 7, :2] - joints[:, 8, :2], axis=-1)
    crossed = ((joints[:, 7] - joints[:, 8]) * clip.rotations[:, 0, :, 0]).sum(-1) < 0.06
    velocity = np.gradient(gaussian_filter1d(clip.root, 2.0, axis=0), 1 / FPS, axis=0)
    speed = np.linalg.norm(velocity[:, :2], axis=-1)
    height = clip.root[:, 2] > 0.8
    return np.where(
        both & (stride < _STRIDE) & ~crossed & height, 0.1 + 0.9 * np.exp(-speed / 0.2), 0
    )


def ahead_of(yaw: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 2"]:
    """Unit vectors in x and y along a heading, radians."""
    return np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)


def left_of(yaw: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 2"]:
    """Unit vectors in x and y to the left of a heading, radians."""
    return np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)


def about_z(yaw: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 3 3"]:
    """Rotations by a yaw, radians."""
    c, s, o = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    return np.stack([c, -s, o, s, c, o, o, o, o + 1.0], axis=-1).reshape(*np.shape(yaw), 3, 3)


def in_space(xy: Float[np.ndarray, "*b 2"]) -> Float[np.ndarray, "*b 3"]:
    """Level vectors, with z 0."""
    return np.concatenate([xy, np.zeros((*xy.shape[:-1], 1))], axis=-1)


def turned_by(
    yaw: Float[np.ndarray, "*#b"], xy: Float[np.ndarray, "*#b 2"]
) -> Float[np.ndarray, "*b 2"]:
    """Points of the plane turned about the origin by a yaw, radians."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = xy[..., 0], xy[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


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


_SIGMA = 9.0
"""Frames over which wheels smooth the way of their owner."""
_MOVES = 0.25
"""Metres per second; slower is standing."""


@dataclass(frozen=True)
class ActorPath:
    """A smooth pelvis path and heading, world, metres and radians."""

    joints: Float[np.ndarray, "frames 24 3"]
    """Joints as they are, steps and all; joint 0 is the pelvis."""
    xy: Float[np.ndarray, "frames 2"]
    yaw: Float[np.ndarray, " frames"]

    @property
    def ahead(self) -> Float[np.ndarray, "frames 2"]:
        """Unit vectors along the heading."""
        return ahead_of(self.yaw)

    @property
    def left(self) -> Float[np.ndarray, "frames 2"]:
        """Unit vectors to the left of it."""
        return left_of(self.yaw)

    def straight(self, span: tuple[int, int]) -> float:
        """Return the mean cosine between way and heading where it moves; 0 where it hardly moves at all."""
        rows = slice(*span)
        velocity = np.gradient(self.xy[rows], 1 / FPS, axis=0)
        speed = np.linalg.norm(velocity, axis=-1)
        moves = speed > _MOVES
        if moves.sum() < FPS:
            return 0.0
        return float(
            ((velocity * self.ahead[rows]).sum(-1) / np.maximum(speed, 1e-9))[moves].mean()
        )


def actor_path(
    body: BodyModel, base_motion: BaseMotion, sigma: float = _SIGMA, turning: float = 1.3 * _SIGMA
) -> ActorPath:
    """Smooth away what steps add to path and heading, over so many frames each (one sigma)."""
    return ActorPath(
        joints=joints_of(body, base_motion.root, base_motion.rotations),
        xy=gaussian_filter1d(base_motion.root[:, :2], sigma, axis=0, mode="nearest"),
        yaw=gaussian_filter1d(heading(base_motion.rotations), turning, mode="nearest"),
    )
