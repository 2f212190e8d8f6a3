"""The way of the feet between the places where they are put down: heel off, swing, heel down."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import PchipInterpolator

from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.directions import about_z
from omomo_core.learning.synthesis.walker.footsteps import FootStance, Footstep
from omomo_core.skeleton import joint

FLAT = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Global rotation of a joint of the rest pose that faces world x (columns: left, up, forward)."""
_ANKLES = (joint("left_ankle"), joint("right_ankle"))
_TOES = (joint("left_foot"), joint("right_foot"))
_HEEL_BEHIND = 0.05
_OFF_LEAST, _OFF_GROWS, _OFF_MOST = 0.26, 0.9, 1.25
"""Radians the heel has risen when the foot leaves for a tiny step, per square metre, and limit."""
_OFF_FLOOR, _STILL_RISING = 0.75, 0.22
"""Share of it while the ball is on the floor; share of the swing in which the heel rises on."""
_OFF_BACK = 0.18
_TOES_UP, _TOES_UP_FROM, _TOES_UP_MOST = 0.35, 0.45, 0.28
"""Radians the toes point up when the heel touches: per metre beyond a length of a forward step."""
_BALL_FIRST, _BALL_FIRST_MOST = 0.55, 0.55
"""Radians per metre: stepping back (half of it: sideways) the ball of the foot touches first."""
_RESTED, _FROM_REST = 24, 5
"""Frames: who has stood so long raises the heel only so long before the first step."""
_FLAT_AFTER = 4
_LEVER = 0.25
"""Metres per radian: a foot that turns is lifted as if it went so far."""
_LIFT, _LIFT_PER_METRE = 0.024, 0.065
"""Metres the ankle rises in the middle of a swing (beyond what pitching does)."""


@dataclass(frozen=True)
class Feet:
    """Where the ankles have to be, and how feet and toes are turned."""

    ankles: Float[np.ndarray, "frames 2 3"]
    rotations: Float[np.ndarray, "frames 2 3 3"]
    toes: Float[np.ndarray, "frames 2 3 3"]
    planted: Float[np.ndarray, "frames 2"]
    """1 while the foot stands, 0 in the air."""


@dataclass(frozen=True)
class _Track:
    """One foot on the floor plan, with its pitch (heel up positive) and its height."""

    place: Float[np.ndarray, "frames 2"]
    yaw: Float[np.ndarray, " frames"]
    heel_up: Float[np.ndarray, " frames"]
    lifted: Float[np.ndarray, " frames"]
    planted: Float[np.ndarray, " frames"]


def walk_feet(
    body: BodyModel, start: FootStance, steps: list[Footstep], frames: int, lift: float
) -> Feet:
    """Ankles and feet for a plan of steps.

    Args:
        body: whose feet.
        start: where the feet are at its first frame.
        steps: in the order of time.
        frames: how many.
        lift: factor on how high the feet are lifted.
    """
    rest = body.rest_joints.double().numpy()
    floor = float(body.vertices[:, 1].min())
    tracks = [
        _track(
            [s for s in steps if s.foot == foot],
            start.place[0, foot],
            start.yaw[0, foot],
            frames,
            lift,
        )
        for foot in (0, 1)
    ]
    poses = [
        _pose(track, rest[_ANKLES[foot]], rest[_TOES[foot]], floor)
        for foot, track in enumerate(tracks)
    ]
    ankles, rotations, toes = (np.stack(part, axis=1) for part in zip(*poses, strict=True))
    return Feet(ankles, rotations, toes, np.stack([t.planted for t in tracks], axis=1))


def _track(
    steps: list[Footstep], place: Float[np.ndarray, " 2"], yaw: float, frames: int, lift: float
) -> _Track:
    out = _Track(
        place=np.tile(place, (frames, 1)),
        yaw=np.full(frames, yaw),
        heel_up=np.zeros(frames),
        lifted=np.zeros(frames),
        planted=np.ones(frames),
    )
    landed = 0
    for k, step in enumerate(steps):
        shift, turn = step.place - place, step.yaw - yaw
        facing = yaw + turn / 2
        forward = float(shift @ [np.cos(facing), np.sin(facing)])
        size = float(np.linalg.norm(shift))
        off, down = _pitches(forward, size)
        # The heel comes off during the last part of the stance, longer before long steps.
        stood = step.lift - landed
        roll = min(round(stood * 0.55), round(3 + 14 * max(forward, 0.0)))
        roll = min(roll, _FROM_REST) if stood > _RESTED else roll
        until = steps[k + 1].lift if k + 1 < len(steps) else frames + 99
        flat = min(_FLAT_AFTER, max(until - step.land, 1))
        peak = step.lift + max(round(_STILL_RISING * (step.land - step.lift)), 1)
        knots = [step.lift - roll, step.lift, peak, step.land, step.land + flat]
        t = np.arange(max(knots[0], 0), min(knots[-1] + 1, frames))
        out.heel_up[t] += _through(t, knots, [0.0, _OFF_FLOOR * off, off, down, 0.0])
        air = np.arange(step.lift, min(step.land, frames))
        u = (air - step.lift) / (step.land - step.lift)
        gone = u**3 * (10 - 15 * u + 6 * u * u)
        out.place[air] = place + gone[:, None] * shift
        out.yaw[air] = yaw + gone * turn
        height = _LIFT + _LIFT_PER_METRE * min(size + _LEVER * abs(turn), 0.7)
        out.lifted[air] = lift * height * (np.sin(np.pi * u**0.85) ** 2)
        out.planted[air] = 0.0
        out.place[step.land :] = step.place
        out.yaw[step.land :] = step.yaw
        place, yaw, landed = step.place, step.yaw, step.land
    return out


def _pitches(forward: float, size: float) -> tuple[float, float]:
    """Heel-up angle when the foot leaves and when it lands, radians; as steps in the mocap."""
    off = min(_OFF_LEAST + _OFF_GROWS * size * size, _OFF_MOST)
    if forward >= 0.7 * size:
        down = -min(_TOES_UP * max(forward - _TOES_UP_FROM, 0.0), _TOES_UP_MOST)
        return off, down
    if forward <= -0.7 * size:
        return _OFF_BACK, min(_BALL_FIRST * size, _BALL_FIRST_MOST)
    return off, min(_BALL_FIRST / 2 * size, _BALL_FIRST_MOST)


def _through(
    t: Int[np.ndarray, " part"], knots: list[int], values: list[float]
) -> Float[np.ndarray, " part"]:
    """A smooth curve through the knots that overshoots nowhere and is level at both ends."""
    level = [knots[0] - 1, *knots, knots[-1] + 1]
    apart = [first + k * 1e-3 for k, first in enumerate(level)]
    return PchipInterpolator(apart, [values[0], *values, values[-1]])(t)


def _pose(
    track: _Track, ankle: Float[np.ndarray, " 3"], toe: Float[np.ndarray, " 3"], floor: float
) -> tuple[
    Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3 3"]
]:
    """Ankle, foot and toe rotation: the foot pitches about its ball, or about its heel."""
    frames = len(track.yaw)
    toes = about_z(track.yaw) @ FLAT
    rotations = toes @ _pitched(track.heel_up)
    # From the ankle to what touches the floor, in the frame of the foot (y up, z forward).
    ball = np.array([0.0, floor - ankle[1], toe[2] - ankle[2]])
    heel = np.array([0.0, floor - ankle[1], -_HEEL_BEHIND])
    pivot = np.where(track.heel_up[:, None] >= 0.0, ball, heel)
    stand = np.concatenate([track.place, np.full((frames, 1), ankle[1] - floor)], axis=-1)
    stand[:, 2] += track.lifted
    held = stand + np.einsum("tij,tj->ti", toes, pivot)
    ankles = held - np.einsum("tij,tj->ti", rotations, pivot)
    # In the air the toes hang with the foot; on the floor they stay level while the heel rises.
    hang = (track.lifted / 0.03).clip(0.0, 1.0)
    free = toes @ _pitched(np.where(track.heel_up > 0, hang, 1.0) * track.heel_up)
    return ankles, rotations, free


def _pitched(angle: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 3 3"]:
    """Rotation about the body-left axis: positive lifts the heel, the toes point down."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.zeros((len(angle), 3, 3))
    R[:, 0, 0] = 1.0
    R[:, 1, 1], R[:, 1, 2], R[:, 2, 1], R[:, 2, 2] = c, -s, s, c
    return R
