"""Collision avoidance of the root: a body inside the object moves as far as its hands still reach."""

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.generation.collision.config import ROOT_SHIFT
from omomo_core.generation.collision.sides import (
    CollisionAvoidance,
    Cost,
    level_shifts,
    squared_distances,
)
from omomo_core.skeleton import joint

SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
ELBOWS = (joint("left_elbow"), joint("right_elbow"))


def move_root_clear(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
    avoidance: CollisionAvoidance,
) -> Float[Tensor, "samples frames 3"]:
    """Return the pelvis shifted horizontally to where the body is clear of the object, world, metres.

    Args:
        body: whose bones.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint, with arms solved onto their targets.
        targets: what is held.
        avoidance: the object.
    """
    tried = level_shifts(ROOT_SHIFT.spacing, ROOT_SHIFT.farthest)
    at, R = root[:, avoidance.seen], rotations[:, avoidance.seen]
    now, share = avoidance.spheres(at, R), _shift_share(avoidance, targets)

    def places(*which: Tensor) -> Tensor:
        return now[which][:, None] + share[which][:, None, None] * tried

    cost = avoidance.collision_cost(
        now, avoidance.anatomy.radii, ROOT_SHIFT.farthest, places, len(tried)
    )
    if cost is None:
        return root
    joints = forward_kinematics(body, at, R)
    cost = cost + ROOT_SHIFT.shift * tried.square().sum(dim=-1)
    for side, (shoulder, wrist) in enumerate(zip(SHOULDERS, WRISTS, strict=True)):
        hand = joints[..., 22 + side, :] - joints[..., wrist, :]
        way = targets.palms[:, avoidance.seen, side] - hand - joints[..., shoulder, :]
        cost = cost + reach_cost(
            body, way[:, :, None] - tried, targets.hold[:, avoidance.seen, side]
        )
    return root + avoidance.smoothed(
        avoidance.cheapest_values(cost, tried, ROOT_SHIFT.change * squared_distances(tried))
    )


def _shift_share(
    avoidance: CollisionAvoidance, targets: InteractionTargets
) -> Float[Tensor, "samples seen balls"]:
    """Return the share of the root's shift in each sphere: holding hands stay, elbows go half the way."""
    share = torch.ones(
        *targets.hold[:, avoidance.seen].shape[:2], avoidance.anatomy.follows.shape[1]
    )
    for side in range(2):
        hold = targets.hold[:, avoidance.seen, side]
        share[..., ELBOWS[side]] -= hold / 2
        share[..., WRISTS[side]] -= hold
    return share @ avoidance.anatomy.follows[5:].T


def reach_cost(
    body: BodyModel,
    ways: Float[Tensor, "samples seen choices 3"],
    hold: Float[Tensor, "samples seen"],
) -> Cost:
    """Return the cost of wrists that are farther out of reach than by the first choice.

    Args:
        body: whose arms.
        ways: from the shoulder to where the wrist must be by each choice, metres.
        hold: how firmly the hand holds, in [0, 1].
    """
    rest, (shoulder, elbow, wrist) = body.rest_joints, (SHOULDERS[0], ELBOWS[0], WRISTS[0])
    length = (rest[elbow] - rest[shoulder]).norm() + (rest[wrist] - rest[elbow]).norm()
    beyond = (ways.norm(dim=-1) - ROOT_SHIFT.stretch * length).clamp(min=0)
    more = (beyond - beyond[..., :1]).clamp(min=0)
    return ROOT_SHIFT.reach * hold[..., None] * more.square()
