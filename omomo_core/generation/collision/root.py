"""A body that is in the object steps aside as a whole, as far as its hands reach what they hold."""

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.generation.collision.sides import Around, Cost, shifts, squared_steps
from omomo_core.generation.wish import Wish
from omomo_core.skeleton import joint

GRID, FARTHEST = 0.0625, 0.25
"""Metres between the places that are tried, and to the farthest of them."""
AWAY, MOVE, REACH = 3.0, 40.0, 4000.0
"""Cost of a place, of going from one to the next, and of a palm out of reach, 1 / m^2."""
STRETCH = 0.98
"""Share of a straight arm's length that is within reach."""
SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
ELBOWS = (joint("left_elbow"), joint("right_elbow"))


def stand_aside(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    wish: Wish,
    around: Around,
) -> Float[Tensor, "samples frames 3"]:
    """The pelvis, shifted on the level to where the body is clear of the object.

    Args:
        body: whose flesh.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint, of arms that hold.
        wish: what is held.
        around: the object.
    """
    tried = shifts(GRID, FARTHEST)
    at, R = root[:, around.seen], rotations[:, around.seen]
    now, share = around.balls(at, R), _going_along(around, wish)

    def places(*which: Tensor) -> Tensor:
        return now[which][:, None] + share[which][:, None, None] * tried

    cost = around.squeezed(now, around.flesh.radii, FARTHEST, places, len(tried))
    if cost is None:
        return root
    joints = forward_kinematics(body, at, R)
    cost = cost + AWAY * tried.square().sum(dim=-1)
    for side, (shoulder, wrist) in enumerate(zip(SHOULDERS, WRISTS, strict=True)):
        hand = joints[..., 22 + side, :] - joints[..., wrist, :]
        way = wish.palms[:, around.seen, side] - hand - joints[..., shoulder, :]
        cost = cost + out_of_reach(body, way[:, :, None] - tried, wish.hold[:, around.seen, side])
    return root + around.eased(around.choose(cost, tried, MOVE * squared_steps(tried)))


def _going_along(around: Around, wish: Wish) -> Float[Tensor, "samples seen balls"]:
    """Share of the body's shift in each ball: hands that hold stay, elbows go half the way."""
    share = torch.ones(*wish.hold[:, around.seen].shape[:2], around.flesh.follows.shape[1])
    for side in range(2):
        hold = wish.hold[:, around.seen, side]
        share[..., ELBOWS[side]] -= hold / 2
        share[..., WRISTS[side]] -= hold
    return share @ around.flesh.follows[5:].T


def out_of_reach(
    body: BodyModel,
    ways: Float[Tensor, "samples seen choices 3"],
    hold: Float[Tensor, "samples seen"],
) -> Cost:
    """What it costs that wrists get farther out of reach than they are by the first choice.

    Args:
        body: whose arms.
        ways: from the shoulder to where the wrist must be, by each choice, metres.
        hold: how strongly it must.
    """
    rest, (shoulder, elbow, wrist) = body.rest_joints, (SHOULDERS[0], ELBOWS[0], WRISTS[0])
    length = (rest[elbow] - rest[shoulder]).norm() + (rest[wrist] - rest[elbow]).norm()
    beyond = (ways.norm(dim=-1) - STRETCH * length).clamp(min=0)
    more = (beyond - beyond[..., :1]).clamp(min=0)
    return REACH * hold[..., None] * more.square()
