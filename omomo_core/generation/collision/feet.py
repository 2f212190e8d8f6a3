"""Collision avoidance of the feet: feet that the object runs into stand elsewhere, or step out of its way."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.interpolate import PchipInterpolator
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.generation.collision.config import FOOT_SHIFT
from omomo_core.generation.collision.sides import (
    CollisionAvoidance,
    level_shifts,
    squared_distances,
)
from omomo_core.generation.solving.config import STEPS
from omomo_core.generation.solving.feet import ANKLES, TOES, FootPlan
from omomo_core.geometry.runs import runs
from omomo_core.skeleton import joint

HIPS = (joint("left_hip"), joint("right_hip"))
KNEES = (joint("left_knee"), joint("right_knee"))


def move_feet_clear(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    feet: list[FootPlan],
    avoidance: CollisionAvoidance,
) -> list[FootPlan]:
    """Return foot plans in which feet and legs are clear of the object.

    Args:
        body: whose legs.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint, with legs solved onto the plans.
        feet: the plan of each sample.
        avoidance: the object.
    """
    root, R = root[:, avoidance.seen], rotations[:, avoidance.seen]
    now, joints = avoidance.spheres(root, R), forward_kinematics(body, root, R)
    for side in range(2):
        chosen = _choose_shifts(body, joints, now, feet, avoidance, side)
        if chosen is not None:
            feet = [
                _shift_foot(plan, shift.numpy(), avoidance.seen, side)
                for plan, shift in zip(feet, chosen, strict=True)
            ]
    return feet


def _choose_shifts(
    body: BodyModel,
    joints: Float[Tensor, "samples seen 24 3"],
    now: Float[Tensor, "samples seen flesh 3"],
    feet: Sequence[FootPlan],
    avoidance: CollisionAvoidance,
    side: int,
) -> Float[Tensor, "samples seen 3"] | None:
    """Return the shifts of one foot over time, metres; None where none is needed."""
    tried = level_shifts(FOOT_SHIFT.spacing, FOOT_SHIFT.farthest)
    share = torch.zeros(24)
    share[[ANKLES[side], TOES[side]]], share[KNEES[side]] = 1.0, 0.5
    share = avoidance.anatomy.follows[5:] @ share
    moving = share > 0
    share, balls, radii = share[moving], now[:, :, moving], avoidance.anatomy.radii[moving]

    def places(sample: Tensor, frame: Tensor, ball: Tensor) -> Tensor:
        return balls[sample, frame, ball][:, None] + share[ball, None, None] * tried

    far = FOOT_SHIFT.farthest * float(share.max())
    cost = avoidance.collision_cost(balls, radii, far, places, len(tried))
    if cost is None:
        return None
    hip, knee, ankle = HIPS[side], KNEES[side], ANKLES[side]
    rest = body.rest_joints
    length = (rest[knee] - rest[hip]).norm() + (rest[ankle] - rest[knee]).norm()
    leg = (joints[..., ankle, :] - joints[..., hip, :])[:, :, None] + tried
    beyond = (leg.norm(dim=-1) - FOOT_SHIFT.stretch * length).clamp(min=0)
    cost = cost + FOOT_SHIFT.shift * tried.square().sum(dim=-1) + FOOT_SHIFT.reach * beyond.square()
    down = torch.from_numpy(np.stack([plan.standing[avoidance.seen, side] for plan in feet]))
    stays, way = (down[:, 1:] & down[:, :-1])[..., None, None], squared_distances(tried)
    return avoidance.cheapest_values(
        cost, tried, FOOT_SHIFT.change * way + FOOT_SHIFT.step * stays * (way > 0)
    )


def _shift_foot(
    plan: FootPlan, shift: Float[np.ndarray, "seen 3"], seen: Int[np.ndarray, " seen"], side: int
) -> FootPlan:
    """Return a plan with one foot shifted, constantly while it is planted, with a step at each change."""
    if not shift.any():
        return plan
    ankles, standing = plan.ankles.copy(), plan.standing.copy()
    frames = np.arange(len(ankles))
    each = np.abs(frames[:, None] - seen).argmin(axis=1)
    changes = np.flatnonzero((np.diff(shift[each], axis=0) != 0).any(axis=1)) + 1
    for start, stop in runs(plan.standing[:, side]):
        for at in changes[(changes > start) & (changes < stop)].tolist():
            swing = slice(
                max(start, at - FOOT_SHIFT.half_step), min(stop, at + FOOT_SHIFT.half_step)
            )
            far = float(np.linalg.norm(shift[each[at]] - shift[each[at - 1]]))
            ankles[swing, side, 2] += min(STEPS.lift, far / 2) * _bump(swing.stop - swing.start)
            standing[swing, side] = False
    known = standing[:, side] | _mid_swing(plan.standing[:, side], seen)
    at = np.flatnonzero(known)
    if len(at) < 2:
        return plan
    way = PchipInterpolator(at, shift[each[at]], axis=0)
    ankles[:, side] += way(frames.clip(at[0], at[-1]))
    return replace(plan, ankles=ankles, standing=standing)


def _bump(frames: int) -> Float[np.ndarray, " frames"]:
    """Return half a sine wave: from 0 to 1 and back."""
    return np.sin(np.pi * np.arange(1, frames + 1) / (frames + 1))


def _mid_swing(
    standing: Bool[np.ndarray, " frames"], seen: Int[np.ndarray, " seen"]
) -> Bool[np.ndarray, " frames"]:
    """Return which of the evaluated frames are in the middle of a swing."""
    found = np.zeros(len(standing), bool)
    found[
        [
            at
            for at in seen
            if not standing[max(0, at - FOOT_SHIFT.half_step) : at + FOOT_SHIFT.half_step + 1].any()
        ]
    ] = True
    return found
