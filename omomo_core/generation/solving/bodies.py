"""Making sampled bodies keep their promises: planted feet stay, holding palms are where they hold.

First body, hands, feet and limbs choose a side of the object (`side`), and the pelvis goes to where arms
and legs reach, then whole stretches are corrected smoothly (`polish`)
against joint ranges, the object's surface and loss of balance, then arms and legs are solved exactly.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import sole_points
from omomo_core.body.trajectory_optimization.anatomy import anatomy, centre_of_mass
from omomo_core.body.trajectory_optimization.solver import firmness, polish
from omomo_core.body.trajectory_optimization.targets import Targets
from omomo_core.generation.collision.feet import step_aside
from omomo_core.generation.collision.limbs import swing_limbs, turn_hands
from omomo_core.generation.collision.root import stand_aside
from omomo_core.generation.collision.sides import FINE, Around
from omomo_core.generation.prefix import Decided, fade
from omomo_core.generation.solving.feet import ANKLES, TOES, Feet, planted_feet
from omomo_core.generation.solving.reach import (
    LONGEST,
    STRETCH,
    ankles_of,
    arms_that_hold,
    within_reach,
)
from omomo_core.generation.wish import Wish

CLEARANCE = 0.02
"""Metres that flesh keeps from the object: balls do not fill the skin to its last fold, the object is
known to a grid's step, and choices pass smoothly into each other."""
ITERATIONS = 5
"""Gauss-Newton steps of the polish."""
_BEFORE, _POLISH = 0.3, 0.5
"""Parts of the time that go by before the polish, and in it."""
AT_ONCE = 2400
"""Frames that are polished side by side, of all samples together: bounds memory."""
LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")


@dataclass(frozen=True)
class Solved:
    """Bodies that keep their promises, or say where they could not."""

    root: Float[Tensor, "samples frames 3"]
    rotations: Float[Tensor, "samples frames 22 3 3"]
    standing: Bool[np.ndarray, "samples frames 2"]
    """Left, right foot is planted."""
    miss: Float[Tensor, "samples frames 2"]
    """How far each palm is from its place where it should hold, metres; 0 where it need not."""


def solve_bodies(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    foot_contact: Float[Tensor, "samples frames 4"],
    wish: Wish,
    decided: Decided | None = None,
    free: Float[Tensor, " frames"] | None = None,
    told: Callable[[float], None] = lambda done: None,
) -> Solved:
    """Solve K samples of one stretch.

    Args:
        body: whose bones.
        root: sampled pelvis, world, metres.
        rotations: sampled global rotations.
        foot_contact: probability that left ankle, right ankle, left toe, right toe is planted.
        wish: what hands hold, and what is in the way.
        decided: the first frames, which stay as they are.
        free: how far pelvis and trunk of each frame may leave the sample, from 0 (not at all) to 1,
            smooth; everywhere 1 if not given.
        told: how far this is.
    """
    free = torch.ones(root.shape[1]) if free is None else free
    if decided is not None:
        root, rotations = _after(decided, root, rotations)
        free = free * (1 - _fade_after(decided.frames, root.shape[1]))
    flesh, field = anatomy(body, clearance=CLEARANCE), wish.barrier.field
    around = Around.of(flesh, field, wish.T_world_object, free)
    root = stand_aside(body, root, arms_that_hold(body, root, rotations, wish), wish, around)
    armed = arms_that_hold(body, root, rotations, wish)
    rotations, wish = turn_hands(body, root, rotations, armed, wish, around)
    feet = _feet(body, root, rotations, foot_contact, decided)
    pose = _Pose(root, _with_feet(rotations, feet))
    pose = replace(pose, root=within_reach(body, root, pose.rotations, feet, wish, free, STRETCH))
    pose = _limbs(body, pose, feet, wish)
    feet = step_aside(body, pose.root, pose.rotations, feet, around)
    pose = _aside(body, _limbs(body, pose, feet, wish), around)
    told(_BEFORE)
    pose = _polished(body, pose, feet, wish, around, told)
    feet = _swung(body, pose, feet)
    near = within_reach(body, pose.root, pose.rotations, feet, wish, free, LONGEST)
    pose = _limbs(body, replace(pose, root=near), feet, wish)
    closely = Around.of(flesh, field, wish.T_world_object, free, FINE)
    pose = _aside(body, pose, closely)
    if decided is not None:
        pose.root[:, : decided.frames] = decided.root
        pose.rotations[:, : decided.frames] = decided.rotations
    palms = forward_kinematics(body, pose.root, pose.rotations)[..., 22:, :]
    miss = (palms - wish.palms).norm(dim=-1)
    return Solved(
        pose.root,
        pose.rotations,
        np.stack([f.standing for f in feet]),
        torch.where(wish.hold > 0.99, miss, 0.0),
    )


@dataclass(frozen=True)
class _Pose:
    root: Float[Tensor, "samples frames 3"]
    rotations: Float[Tensor, "samples frames 22 3 3"]


def _fade_after(first: int, frames: int) -> Float[Tensor, " frames"]:
    """1 in the first frames, smoothly to 0 after them."""
    return torch.cat([torch.ones(first - 1), fade(frames - first + 1)])


def _after(
    decided: Decided, root: Tensor, rotations: Tensor
) -> tuple[Float[Tensor, "samples frames 3"], Float[Tensor, "samples frames 22 3 3"]]:
    """The first frames as decided; what that changes fades out after them."""
    first = decided.frames
    weight = _fade_after(first, root.shape[1])[:, None]
    step = roma.rotmat_to_rotvec(rotations[:, first - 1].mT @ decided.rotations[:, -1])
    turned = rotations @ roma.rotvec_to_rotmat(weight[..., None] * step[:, None])
    moved = root + weight * (decided.root[:, -1:] - root[:, first - 1 : first])
    turned[:, :first], moved[:, :first] = decided.rotations, decided.root
    return moved, turned


def _feet(
    body: BodyModel, root: Tensor, rotations: Tensor, foot_contact: Tensor, decided: Decided | None
) -> list[Feet]:
    joints = forward_kinematics(body, root, rotations).double().numpy()
    R, down = rotations.double().numpy(), foot_contact.numpy()
    stood = [None] * len(R) if decided is None else decided.standing
    return [planted_feet(body, joints[k], R[k], down[k], stood[k]) for k in range(len(R))]


def _with_feet(
    rotations: Float[Tensor, "samples frames 22 3 3"], feet: list[Feet]
) -> Float[Tensor, "samples frames 22 3 3"]:
    planned = np.stack([f.rotations for f in feet]).swapaxes(2, 3)
    turned = rotations.clone()
    turned[:, :, (*ANKLES, *TOES)] = torch.from_numpy(planned).to(rotations).flatten(2, 3)
    return turned


def _limbs(body: BodyModel, pose: _Pose, feet: list[Feet], wish: Wish) -> _Pose:
    ankles, rotations = ankles_of(feet), pose.rotations
    for side in range(2):
        rotations, _ = reach(body, pose.root, rotations, LEGS[side], ankles[..., side, :])
    return replace(pose, rotations=arms_that_hold(body, pose.root, rotations, wish))


def _aside(body: BodyModel, pose: _Pose, around: Around) -> _Pose:
    return replace(pose, rotations=swing_limbs(body, pose.root, pose.rotations, around))


def _swung(body: BodyModel, pose: _Pose, feet: list[Feet]) -> list[Feet]:
    """Feet in the air go the way that the polish has found for them."""
    joints = forward_kinematics(body, pose.root, pose.rotations).double().numpy()
    found, planned = joints[..., ANKLES, :], np.stack([f.ankles for f in feet])
    firm = firmness(np.stack([f.standing for f in feet]))[..., None]
    return [
        replace(f, ankles=way)
        for f, way in zip(feet, found + firm * (planned - found), strict=True)
    ]


def _polished(
    body: BodyModel,
    pose: _Pose,
    feet: list[Feet],
    wish: Wish,
    around: Around,
    told: Callable[[float], None],
) -> _Pose:
    """Every sample corrected as a whole, as many side by side as memory should hold."""
    samples, frames = pose.root.shape[:2]
    targets, count = _targets(body, pose, feet, wish), max(1, AT_ONCE // frames)
    root, rotations = pose.root.double().numpy(), pose.rotations.double().numpy()
    solved = [
        polish(
            body,
            root[some],
            rotations[some],
            targets.of(some),
            flesh=around.flesh,
            free=around.free.numpy(),
            steps=ITERATIONS,
            told=lambda done, k=k: told(_BEFORE + _POLISH * min((k + count * done) / samples, 1.0)),
        )
        for k in range(0, samples, count)
        for some in (slice(k, k + count),)
    ]
    return _Pose(
        *(torch.from_numpy(np.concatenate([s[i] for s in solved])).float() for i in (0, 1))
    )


def _targets(body: BodyModel, pose: _Pose, feet: list[Feet], wish: Wish) -> Targets:
    root, rotations = (x.double().flatten(0, 1).numpy() for x in (pose.root, pose.rotations))
    soles = sole_points(body, root, rotations).reshape(*pose.root.shape[:2], 4, 3)
    standing, rolling = (
        np.stack(of) for of in zip(*((f.standing, f.rolling) for f in feet), strict=True)
    )
    joints = forward_kinematics(body, pose.root, pose.rotations).double().numpy()
    return Targets(
        palms=wish.palms.double().numpy(),
        R_world_wrist=wish.R_world_wrist.double().numpy(),
        pull=wish.hold.double().numpy(),
        ankles=np.stack([f.ankles for f in feet]),
        soles=soles,
        planted=np.concatenate([standing & ~rolling, standing], axis=-1),
        centre=centre_of_mass(joints),
        T_world_object=wish.T_world_object,
        barrier=wish.barrier,
        balance=wish.balance,
        load=0.0,
    )
