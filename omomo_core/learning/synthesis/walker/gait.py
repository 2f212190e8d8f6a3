"""A body on a root path by small steps: feet first, the pelvis over them, then the rest."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.base_motion import (
    about_z,
    ahead_of,
    in_space,
    left_of,
    turned_by,
)
from omomo_core.learning.synthesis.walker.footsteps import (
    FootStance,
    Footstep,
    RootPath,
    neutral_stance,
    plan_steps,
)
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS, joint

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
    """The ankles' places, and the turns of feet and toes."""

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


_LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")
_HIPS = (joint("left_hip"), joint("right_hip"))
_KNEES = (joint("left_knee"), joint("right_knee"))
_UP = np.array([0.0, 0.0, 1.0])
_STRAIGHTEST = 0.992
"""Part of the whole leg: knees stay a little soft."""
_DIP = 0.014
"""Metres the pelvis sinks while one foot is in the air: knees give a little."""
_ROLL = 0.055
_HIP_TURN = 0.10
"""Radians of pelvis yaw per metre of one foot ahead."""
_LEAN = 0.045
"""Radians of leaning forward per m/s."""


@dataclass(frozen=True)
class GaitStyle:
    """What differs from person to person."""

    over_stance: float
    """Share of the way to the standing foot by which the pelvis goes over it in slow steps."""
    with_feet: float
    """How much the pelvis moves with the middle of the feet, step by step, instead of steadily."""
    arm_swing: float
    """Radians per metre by which one foot is ahead of the other."""
    lift: float
    """Factor on how high the feet are lifted."""
    dwell: float
    """Factor on the time on both feet between steps."""


def draw_gait_style(rng: np.random.Generator) -> GaitStyle:
    """A random person."""
    return GaitStyle(
        over_stance=rng.uniform(0.18, 0.34),
        with_feet=rng.uniform(0.2, 0.5),
        arm_swing=rng.uniform(0.2, 0.75),
        lift=rng.uniform(0.8, 1.3),
        dwell=rng.uniform(0.7, 1.7),
    )


@dataclass(frozen=True)
class Bearing:
    """How somebody stands, over time: pose in the frame of the body (facing world x)."""

    height: Float[np.ndarray, " frames"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    apart: Float[np.ndarray, "frames 2 2"]
    """Ankles beside the pelvis: x forward, y left, metres; left then right."""
    toe_out: Float[np.ndarray, "frames 2"]
    """Yaw of the feet, radians."""


def step_along(
    rng: np.random.Generator, body: BodyModel, bearing: Bearing, path: RootPath
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Root and global rotations of a body that steps along a path."""
    frames = len(path.heading)
    neutral = neutral_stance(path, bearing.apart, bearing.toe_out)
    manner = draw_gait_style(rng)
    steps = plan_steps(rng, path, neutral, manner.dwell)
    feet = walk_feet(body, neutral, steps, frames, manner.lift)
    root_xy = _pelvis_way(path, feet, bearing, manner)
    ahead = _ahead(path, feet)
    stride = ahead - _smooth(ahead, 20.0)
    rotations = _carriage(path, feet, bearing, stride)
    _swing_arms(path, rotations, -manner.arm_swing * stride)
    standing = bearing.height - _DIP * _slow(path)[:, 0] * _smooth(
        1 - feet.planted.min(axis=1), 3.0
    )
    height = _pelvis_height(body, root_xy, rotations, feet, standing)
    root = np.concatenate([root_xy, height[:, None]], axis=-1)
    return root, _with_legs(body, root, rotations, feet)


def _pelvis_way(
    path: RootPath, feet: Feet, bearing: Bearing, manner: GaitStyle
) -> Float[np.ndarray, "frames 2"]:
    """The path, with the pelvis shifted over the standing foot and drawn along by the feet."""
    under = turned_by(path.heading, bearing.apart.mean(axis=1))
    slow = _slow(path)
    places = feet.ankles[..., :2]
    middle = _smooth(places.mean(axis=1) - under, 4.5)
    way = path.position + manner.with_feet * slow * (middle - path.position)
    load = feet.planted / feet.planted.sum(axis=1, keepdims=True).clip(1.0)
    loaded = (load[..., None] * places).sum(axis=1) - places.mean(axis=1)
    return way + (0.5 + 0.5 * slow) * manner.over_stance * _across(path, _smooth(loaded, 4.0))


def _slow(path: RootPath) -> Float[np.ndarray, "frames 1"]:
    """1 at rest, falling to 0 at a brisk walk."""
    speed = _smooth(np.linalg.norm(np.gradient(path.position, axis=0), axis=1) * FPS, 6.0)
    return np.exp(-((speed / 0.8) ** 2))[:, None]


def _across(path: RootPath, shift: Float[np.ndarray, "frames 2"]) -> Float[np.ndarray, "frames 2"]:
    """The part of a shift across the body: fore and aft the path decides."""
    left, along = left_of(path.heading), ahead_of(path.heading)
    sideways, forward = (shift * left).sum(-1), (shift * along).sum(-1)
    return sideways[:, None] * left + 0.25 * forward[:, None] * along


def _ahead(path: RootPath, feet: Feet) -> Float[np.ndarray, " frames"]:
    """Metres by which the left foot is ahead of the right one."""
    apart = feet.ankles[:, 0, :2] - feet.ankles[:, 1, :2]
    return _smooth((apart * ahead_of(path.heading)).sum(-1), 2.5)


def _carriage(
    path: RootPath, feet: Feet, bearing: Bearing, stride: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Everything but the legs: heading, lean, pelvis and shoulders against each other."""
    frames = len(path.heading)
    turning = _smooth(np.gradient(path.heading) * FPS, 5.0)
    forward = (np.gradient(path.position, axis=0) * ahead_of(path.heading)).sum(-1) * FPS
    lean = _LEAN * _smooth(forward, 6.0) + 0.02 * _smooth(np.gradient(forward) * FPS, 6.0)
    roll = _ROLL * _smooth(feet.planted[:, 0] - feet.planted[:, 1], 3.5)
    # The left foot ahead turns the pelvis to the right, and the shoulders to the left.
    hips, chest = -_HIP_TURN * stride, 0.12 * stride + 0.06 * turning
    base = bearing.rotations
    out = np.empty((frames, 22, 3, 3))
    weights = {"pelvis": 0.0, "spine1": 0.3, "spine2": 0.6}
    for j, name in enumerate(BODY_JOINTS):
        w = weights.get(name, 1.0)
        head = 0.10 * turning if name in ("head", "neck") else 0.0
        yaw = path.heading + (1 - w) * hips + w * chest + head
        if j in _HIPS + _KNEES + _ANKLES + _TOES:
            yaw = path.heading + hips
        upright = 0.4 if name in ("head", "neck") else 1.0
        tilt = np.stack([(1 - 1.4 * w) * roll, upright * w * lean, np.zeros(frames)], axis=-1)
        turn = Rotation.from_rotvec(yaw[:, None] * _UP) * Rotation.from_rotvec(tilt)
        out[:, j] = turn.as_matrix() @ base[:, j]
    return out


def _swing_arms(
    path: RootPath,
    rotations: Float[np.ndarray, "frames 22 3 3"],
    left: Float[np.ndarray, " frames"],
) -> None:
    """Each arm swings with the other side's foot, the forearm a little more than the upper arm."""
    axis = in_space(left_of(path.heading))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for name, share in (("shoulder", 1.0), ("elbow", 1.25), ("wrist", 1.3)):
            j = joint(f"{side}_{name}")
            turn = Rotation.from_rotvec(-axis * (sign * share * left)[:, None]).as_matrix()
            rotations[:, j] = turn @ rotations[:, j]


def _pelvis_height(
    body: BodyModel,
    way: Float[np.ndarray, "frames 2"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    feet: Feet,
    standing: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, " frames"]:
    """Return the pelvis height of somebody who stands, lower where a leg would not reach its foot."""
    rest = body.rest_joints.double().numpy()
    limit = np.full(len(way), np.inf)
    for side in (0, 1):
        hip, knee, ankle = rest[_HIPS[side]], rest[_KNEES[side]], rest[_ANKLES[side]]
        length = _STRAIGHTEST * (np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
        offset = rotations[:, 0] @ (hip - rest[0])
        across = way + offset[:, :2] - feet.ankles[:, side, :2]
        fall = np.sqrt((length**2 - (across**2).sum(-1)).clip(0.09))
        limit = np.minimum(limit, feet.ankles[:, side, 2] + fall - offset[:, 2])
    # Lowered before the leg is too short, not when it is: smooth below the limit, then once more.
    height = np.minimum(standing, limit)
    short = gaussian_filter1d(standing - height, 3.0, mode="nearest")
    return _smooth(np.minimum(standing - short, limit), 1.5)


def _with_legs(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    feet: Feet,
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Solve the legs onto the feet, the knees between where pelvis and foot face."""
    turned = torch.as_tensor(rotations)
    for side, leg in enumerate(_LEGS):
        turned[:, _ANKLES[side]] = torch.as_tensor(feet.rotations[:, side])
        turned[:, _TOES[side]] = torch.as_tensor(feet.toes[:, side])
        pole = rotations[:, 0, :, 2] + 1.5 * feet.toes[:, side, :, 2]
        goal = torch.as_tensor(feet.ankles[:, side])
        turned, _ = reach(body, torch.as_tensor(root), turned, leg, goal, torch.as_tensor(pole))
    return turned.numpy()


def blend_poses(
    first: Float[np.ndarray, "22 3 3"], last: Float[np.ndarray, "22 3 3"], share: np.ndarray
) -> Float[np.ndarray, "frames 22 3 3"]:
    """From one pose to another along the geodesic of each joint."""
    step = (Rotation.from_matrix(first).inv() * Rotation.from_matrix(last)).as_rotvec()
    turns = Rotation.from_rotvec((share[:, None, None] * step).reshape(-1, 3)).as_matrix()
    return first @ turns.reshape(len(share), 22, 3, 3)


def _smooth(x: np.ndarray, sigma: float) -> np.ndarray:
    return gaussian_filter1d(x, sigma, axis=0, mode="nearest")
