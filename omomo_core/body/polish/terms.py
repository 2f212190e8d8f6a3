"""The cost of a pose, as weighted squares with their derivatives in the bones' turns."""

from dataclasses import dataclass, fields

import numpy as np
import roma
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.polish.anatomy import BONES, LIMITS, VALUES, Anatomy
from omomo_core.body.polish.barrier import Barrier
from omomo_core.skeleton import MODEL_PARENTS, joint

_PALM, _ANKLE, _SWING = 60.0, 60.0, 6.0
"""Weights: square roots of 1 / m or 1 / rad; a palm 1/60 m off costs as much as 1 rad."""
_FLESH, _BALANCE, _LIMIT, _HAND = 50.0, 14.0, 3.0, 1.5
_FOOT = 0.05
"""How far the foot supports beyond the lines from heel to ball, metres."""
_ANYWHERE = 1e6
"""Support of somebody in the air: there is no balance to keep."""
_DIRECTIONS = 16
_ABOVE = [max(parent, 0) for parent in MODEL_PARENTS]
_PARENT_JOINTS = [joint(parent) for parent, _, _ in LIMITS]
_CHILD_JOINTS = [joint(child) for _, child, _ in LIMITS]
_WRISTS = [joint("left_wrist"), joint("right_wrist")]
_RANGES = torch.tensor([ranges for *_, ranges in LIMITS])


@dataclass(frozen=True)
class Goals:
    """Targets at the frames that are looked at, float32."""

    palms: Float[Tensor, "times 2 3"]
    R_world_wrist: Float[Tensor, "times 2 3 3"]
    pull: Float[Tensor, "times 2"]
    ankles: Float[Tensor, "times 2 3"]
    planted: Float[Tensor, "times 2"]
    support: Float[Tensor, "times directions"]
    """How far the feet support in each direction, world, metres."""
    balance: Float[Tensor, " times"]
    load: Float[Tensor, "times 3"]
    """Mass times place of the object where it is carried, kilogram metres."""
    load_mass: Float[Tensor, " times"]
    T_world_object: Float[Tensor, "times 4 4"]
    barrier: Barrier

    def at(self, frames: Int[np.ndarray, " n"]) -> "Goals":
        """Some of the frames."""
        timed = {f.name: getattr(self, f.name) for f in fields(self)}
        return Goals(**{k: v if k == "barrier" else v[frames] for k, v in timed.items()})


_Rows = tuple[Float[Tensor, "times rows values"], Float[Tensor, "times rows"]]


def directions() -> Float[Tensor, "directions 3"]:
    """Level directions all around."""
    angle = torch.arange(_DIRECTIONS) * (2 * torch.pi / _DIRECTIONS)
    return torch.stack([angle.cos(), angle.sin(), torch.zeros(_DIRECTIONS)], dim=-1)


def support(
    soles: Float[Tensor, "times 4 3"],
    planted: Float[Tensor, "times 4"],
    centre: Float[Tensor, "times 3"],
) -> Float[Tensor, "times directions"]:
    """How far somebody is supported in each of the directions, everywhere when in the air.

    Args:
        soles: heels and balls of the feet.
        planted: which of them stand.
        centre: of mass, of a recording: there it did not fall over.
    """
    reach = soles @ directions().T.to(soles)
    reach = reach.masked_fill(planted[..., None] == 0, -torch.inf).amax(dim=1) + _FOOT
    reach = torch.maximum(reach, centre @ directions().T)
    return torch.where(planted.any(dim=1, keepdim=True), reach, _ANYWHERE)


def points_of(
    anatomy: Anatomy, root: Float[Tensor, "times 3"], rotations: Float[Tensor, "times 22 3 3"]
) -> tuple[Float[Tensor, "times points 3"], Float[Tensor, "times 24 3"]]:
    """Points of the anatomy and the bone vectors they are made of, world, metres."""
    bones = (rotations[:, _ABOVE] @ anatomy.offsets[:, :, None])[..., 0]
    return root[:, None] + anatomy.placing @ bones, bones


def rows(
    anatomy: Anatomy,
    goals: Goals,
    root: Float[Tensor, "times 3"],
    rotations: Float[Tensor, "times 22 3 3"],
) -> _Rows:
    """Jacobian and residual of all weighted squares but closeness and smoothness."""
    points, bones = points_of(anatomy, root, rotations)
    ends, normals, errors = _reaching(goals, points)
    hit, away, depth = _colliding(anatomy, goals, points)
    off, tilt = _balancing(anatomy, goals, points)
    which = torch.tensor([*ends, *hit, 4])
    normals = torch.cat([normals, away, tilt], dim=1)
    errors = torch.cat([errors, depth, off], dim=1)
    levers = (anatomy.levers.flatten(0, 1) @ bones).unflatten(1, anatomy.levers.shape[:2])
    turning = torch.linalg.cross(levers[:, which], normals[:, :, None], dim=-1)
    position = torch.cat([normals[:, :, None], turning], dim=2).flatten(2)
    angular = [_limiting(rotations), _holding(goals, rotations)]
    return (
        torch.cat([position, *(J for J, _ in angular)], dim=1),
        torch.cat([errors, *(r for _, r in angular)], dim=1),
    )


def _reaching(
    goals: Goals, points: Float[Tensor, "times points 3"]
) -> tuple[list[int], Float[Tensor, "times 12 3"], Float[Tensor, "times 12"]]:
    """Palms and ankles to their places."""
    weight = torch.cat([_PALM * goals.pull, _SWING + (_ANKLE - _SWING) * goals.planted], dim=1)
    error = (points[:, :4] - torch.cat([goals.palms, goals.ankles], dim=1)) * weight[..., None]
    normals = weight[..., None, None] * torch.eye(3)
    return [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3], normals.flatten(1, 2), error.flatten(1)


def _colliding(
    anatomy: Anatomy, goals: Goals, points: Float[Tensor, "times points 3"]
) -> tuple[list[int], Float[Tensor, "times flesh 3"], Float[Tensor, "times flesh"]]:
    """Balls of flesh out of the object."""
    R, at = goals.T_world_object[:, :3, :3], goals.T_world_object[:, :3, 3]
    local = (points[:, 5:] - at[:, None]) @ R
    depth, normal = goals.barrier.depth(local, anatomy.radii)
    touching = _FLESH * (depth > 0)
    return (
        list(range(5, points.shape[1])),
        -touching[..., None] * (normal @ R.mT),
        touching * depth,
    )


def _balancing(
    anatomy: Anatomy, goals: Goals, points: Float[Tensor, "times points 3"]
) -> tuple[Float[Tensor, "times 1"], Float[Tensor, "times 1 3"]]:
    """The centre of mass back over the feet, from the side on which it is farthest out."""
    weight, normal = overbalance(anatomy, goals, points[:, 4])
    share = anatomy.mass / (anatomy.mass + goals.load_mass)
    strong = (_BALANCE * goals.balance * (weight > 0))[:, None]
    return strong * weight[:, None], (strong * share[:, None] * normal)[:, None]


def overbalance(
    anatomy: Anatomy, goals: Goals, centre: Float[Tensor, "times 3"]
) -> tuple[Float[Tensor, " times"], Float[Tensor, "times 3"]]:
    """How far the centre of mass with its load is out of the support, and in which direction."""
    total = anatomy.mass + goals.load_mass
    loaded = (anatomy.mass * centre + goals.load) / total[:, None]
    out, side = (loaded @ directions().T - goals.support).max(dim=-1)
    return out, directions()[side]


def _limiting(rotations: Float[Tensor, "times 22 3 3"]) -> _Rows:
    """Joints back into their ranges."""
    R = rotations[:, _PARENT_JOINTS]
    turned = roma.rotmat_to_rotvec(R.mT @ rotations[:, _CHILD_JOINTS])
    beyond = turned - turned.clamp(_RANGES[..., 0], _RANGES[..., 1])
    axes = R.mT * (_LIMIT * (beyond != 0))[..., None]
    J = axes.new_zeros(len(R), len(LIMITS), 3, VALUES)
    for k, (parent, child, _) in enumerate(LIMITS):
        J[:, k, :, _columns(child)] = axes[:, k]
        J[:, k, :, _columns(parent)] = -axes[:, k]
    return J.flatten(1, 2), (_LIMIT * beyond).flatten(1)


def _holding(goals: Goals, rotations: Float[Tensor, "times 22 3 3"]) -> _Rows:
    """Hands as the grasp wants them."""
    weight = (_HAND * goals.pull)[..., None]
    off = roma.rotmat_to_rotvec(rotations[:, _WRISTS] @ goals.R_world_wrist.mT) * weight
    J = off.new_zeros(len(off), 2, 3, VALUES)
    for k, bone in enumerate(("left_wrist", "right_wrist")):
        J[:, k, :, _columns(bone)] = weight[:, k, None] * torch.eye(3)
    return J.flatten(1, 2), off.flatten(1)


def _columns(bone: str) -> slice:
    first = 3 + 3 * BONES.index(bone)
    return slice(first, first + 3)
