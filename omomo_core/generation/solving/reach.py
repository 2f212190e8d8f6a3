"""Reach: the pelvis moves to where arms reach what they hold, and legs the floor."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.generation.collision.root import ELBOWS, SHOULDERS
from omomo_core.generation.solving.config import REACH
from omomo_core.generation.solving.feet import FootPlan

ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")


def solve_arms(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
) -> Float[Tensor, "samples frames 22 3 3"]:
    """Return rotations with both arms solved onto the palm targets, weighted by how firmly hands hold.

    Args:
        body: whose arms.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        targets: what hands hold.
    """
    for side in range(2):
        weight = targets.hold[..., side].contiguous()
        palms = targets.palms[..., side, :]
        rotations, _ = reach(body, root, rotations, ARMS[side], palms, weight=weight, gently=True)
    return rotations


def move_root_within_reach(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    feet: Sequence[FootPlan],
    targets: InteractionTargets,
    free: Float[Tensor, " frames"],
    stretch: float,
) -> Float[Tensor, "samples frames 3"]:
    """Return the pelvis moved to where arms reach what they hold, and legs the floor; world, metres.

    Args:
        body: whose arms and legs.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        feet: where they stand.
        targets: what hands hold.
        free: how far each frame may be moved, from 0 to 1.
        stretch: share of a straight arm's length that is within reach.
    """

    def nearer(at: Tensor) -> Tensor:
        for _ in range(REACH.rounds):
            towards = _towards(body, at, rotations, targets, stretch) * free[:, None]
            far = towards.norm(dim=-1, keepdim=True)
            # Each sample stops by itself: its result does not depend on the others.
            lacking = far.amax(dim=1, keepdim=True) > REACH.near
            if not lacking.any():
                break
            move = at + towards - root
            limit = REACH.farthest / move.norm(dim=-1, keepdim=True).clamp(min=REACH.farthest)
            at = torch.where(lacking & (far > 0), root + move * limit, at)
        return at

    near = nearer(root)
    drop = _drop(body, near, rotations, feet) * free
    # What the legs need may take from the arms what they had.
    return nearer(near - drop[..., None] * torch.tensor([0.0, 0.0, 1.0]))


def ankles_of(feet: Sequence[FootPlan]) -> Float[Tensor, "samples frames 2 3"]:
    """Return the left and right ankle of each plan, world, metres."""
    return torch.from_numpy(np.stack([f.ankles for f in feet])).float()


def _towards(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
    stretch: float,
) -> Float[Tensor, "samples frames 3"]:
    """Return a smooth move of the pelvis towards palm targets that are out of reach, metres."""
    joints = forward_kinematics(body, root, rotations)
    rest, move = body.rest_joints, torch.zeros_like(root)
    for side in range(2):
        shoulder, elbow, wrist = SHOULDERS[side], ELBOWS[side], WRISTS[side]
        length = (rest[elbow] - rest[shoulder]).norm() + (rest[wrist] - rest[elbow]).norm()
        target = targets.palms[..., side, :] - (joints[..., 22 + side, :] - joints[..., wrist, :])
        way = target - joints[..., shoulder, :]
        distance = way.norm(dim=-1, keepdim=True).clamp(min=1e-6)
        excess = (distance - stretch * length).clamp(min=0) * targets.hold[..., side, None]
        move = move + 0.5 * excess * way / distance
    return torch.from_numpy(
        gaussian_filter1d(move.numpy(), REACH.smoothing, axis=-2, mode="nearest")
    )


def _drop(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    feet: Sequence[FootPlan],
) -> Float[Tensor, "samples frames"]:
    """Return how much lower the pelvis must be for the legs to reach the feet that stand, metres."""
    joints = forward_kinematics(body, root, rotations)
    ankles, standing = ankles_of(feet), torch.from_numpy(np.stack([f.standing for f in feet]))
    rest, drop = body.rest_joints, torch.zeros(root.shape[:2])
    for side, (hip, knee, ankle) in enumerate(((1, 4, 7), (2, 5, 8))):
        length = (rest[knee] - rest[hip]).norm() + (rest[ankle] - rest[knee]).norm()
        way = joints[..., hip, :] - ankles[..., side, :]
        across = way[..., :2].norm(dim=-1)
        height = (
            ((REACH.leg_stretch * length) ** 2 - across**2)
            .clamp(min=REACH.least_height_squared)
            .sqrt()
        )
        drop = torch.maximum(
            drop, (way[..., 2] - height).clamp(0, REACH.lowest) * standing[..., side]
        )
    # The largest need of the neighbourhood, then smoothed: never less than the need itself.
    near = maximum_filter1d(drop.numpy(), REACH.lowering_window, axis=-1, mode="nearest")
    return torch.from_numpy(
        gaussian_filter1d(near, REACH.lowering_smoothing, axis=-1, mode="nearest")
    )
