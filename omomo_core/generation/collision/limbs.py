"""Collision avoidance of limbs: they swing about the line from root to end; hands turn about palms."""

from dataclasses import replace

import roma
import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.generation.collision.config import HAND_TURN, LIMB_SWING
from omomo_core.generation.collision.feet import HIPS, KNEES
from omomo_core.generation.collision.root import ELBOWS, SHOULDERS, reach_cost
from omomo_core.generation.collision.sides import CollisionAvoidance, squared_distances
from omomo_core.generation.solving.feet import ANKLES
from omomo_core.skeleton import PALM_JOINTS

LIMBS = tuple(
    (*joints, farthest, stiffness)
    for upper, middle, end, farthest, stiffness in (
        (SHOULDERS, ELBOWS, WRISTS, LIMB_SWING.farthest_arm, LIMB_SWING.arm_stiffness),
        (HIPS, KNEES, ANKLES, LIMB_SWING.farthest_leg, LIMB_SWING.leg_stiffness),
    )
    for joints in zip(upper, middle, end, strict=True)
)
"""Upper, middle and end joint, largest swing in radians, and its cost, 1 / rad^2."""
TURNS = torch.cartesian_prod(torch.tensor(HAND_TURN.headings), torch.tensor(HAND_TURN.lifts))
"""Turns of a hand that are tried, radians: about the palm's normal, and the wrist up from the surface."""


def swing_limbs_clear(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    avoidance: CollisionAvoidance,
) -> Float[Tensor, "samples frames 22 3 3"]:
    """Return rotations whose elbows and knees keep arms and legs clear of the object; palms and feet stay.

    Args:
        body: whose limbs.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        avoidance: the object.
    """
    joints, out = forward_kinematics(body, root, rotations), rotations.clone()
    balls = avoidance.spheres(root[:, avoidance.seen], rotations[:, avoidance.seen])
    for upper, middle, end, farthest, stiffness in LIMBS:
        axis = normalize(joints[..., end, :] - joints[..., upper, :], dim=-1)
        angles = _both_ways(farthest)
        own = avoidance.anatomy.follows[5:, middle] > 0
        pivot = joints[:, avoidance.seen, upper]
        lever = balls[:, :, own] - pivot[:, :, None]

        turn = roma.rotvec_to_rotmat(axis[:, avoidance.seen, None] * angles)

        def places(
            sample: Tensor,
            frame: Tensor,
            ball: Tensor,
            pivot: Tensor = pivot,
            lever: Tensor = lever,
            turn: Tensor = turn,
        ) -> Tensor:
            swung = turn[sample, frame] * lever[sample, frame, ball][:, None, None]
            return pivot[sample, frame][:, None] + swung.sum(dim=-1)

        far = 2 * float(lever.norm(dim=-1).max())
        cost = avoidance.collision_cost(
            balls[:, :, own], avoidance.anatomy.radii[own], far, places, len(angles)
        )
        if cost is None:
            continue
        cost = cost + stiffness * angles[:, 0].square()
        angle = avoidance.smoothed(
            avoidance.cheapest_values(cost, angles, LIMB_SWING.change * squared_distances(angles))
        )
        turn = roma.rotvec_to_rotmat(axis * angle)[:, :, None]
        out[:, :, [upper, middle]] = turn @ out[:, :, [upper, middle]]
    return out


def _both_ways(farthest: float) -> Float[Tensor, "choices 1"]:
    """Return the swings to try, radians, zero first."""
    one = torch.linspace(0, farthest, LIMB_SWING.swings + 1)[1:]
    return torch.cat([torch.zeros(1), one, -one])[:, None]


def turn_hands_clear(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    armed: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
    avoidance: CollisionAvoidance,
) -> tuple[Float[Tensor, "samples frames 22 3 3"], InteractionTargets]:
    """Return holding hands turned so that wrists and forearms are clear of the object; palms stay.

    Args:
        body: whose hands.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        armed: the same with arms solved onto their targets.
        targets: what is held.
        avoidance: the object.

    Returns:
        The rotations and the targets with the hands turned.
    """
    at, R = root[:, avoidance.seen], armed[:, avoidance.seen]
    joints, out, grasp = (
        forward_kinematics(body, at, R),
        rotations.clone(),
        targets.R_world_wrist.clone(),
    )
    for side, (elbow, wrist) in enumerate(zip(ELBOWS, WRISTS, strict=True)):
        share = avoidance.anatomy.follows[5:, wrist]
        own = share > HAND_TURN.moved_share
        share, radii = share[own, None], avoidance.anatomy.radii[own]
        palm = body.rest_joints[PALM_JOINTS[side]] - body.rest_joints[wrist]
        palms, start = targets.palms[:, avoidance.seen, side], joints[:, :, None, None, elbow]
        tried = R[:, :, wrist][:, :, None] @ _turned(TURNS, side)
        ends = (palms[:, :, None] - tried @ palm)[..., None, :]
        balls = start + share * (ends - start)

        def places(sample: Tensor, frame: Tensor, ball: Tensor, balls: Tensor = balls) -> Tensor:
            return balls[sample, frame, :, ball]

        far = 2 * float(palm.norm())
        cost = avoidance.collision_cost(balls[:, :, 0], radii, far, places, len(TURNS))
        if cost is None:
            continue
        hold = targets.hold[:, avoidance.seen, side]
        cost = hold[..., None] * cost + HAND_TURN.stiffness * TURNS.square().sum(dim=-1)
        shoulder = joints[:, :, None, SHOULDERS[side]]
        cost = cost + reach_cost(body, ends[..., 0, :] - shoulder, hold)
        angles = avoidance.smoothed(
            avoidance.cheapest_values(cost, TURNS, HAND_TURN.change * squared_distances(TURNS))
        )
        turn = _turned(angles, side)
        out[:, :, wrist] = out[:, :, wrist] @ turn
        grasp[:, :, side] = grasp[:, :, side] @ turn
    return out, replace(targets, R_world_wrist=grasp)


def _turned(angles: Float[Tensor, "*b 2"], side: int) -> Float[Tensor, "*b 3 3"]:
    """Return turns of a left (0) or right (1) hand, whose palm looks along -y and fingers outward at rest."""
    heading, lift = angles.split(1, dim=-1)
    up = lift * torch.tensor([0.0, 0.0, 2.0 * side - 1.0])
    about = heading * torch.tensor([0.0, 1.0, 0.0])
    return roma.rotvec_to_rotmat(about) @ roma.rotvec_to_rotmat(up)
