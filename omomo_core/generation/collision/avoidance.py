"""Bodies led out of the object: pelvis, limbs and feet, on the side on which they stand.

Gradients push flesh across a thin board out of both its faces at once, and it stays. So sides are chosen
first: every choice is tried in every evaluated frame, and the path is found that is least inside the object,
nearest to the present body, and steady.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float, Int
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import (
    Anatomy,
    InteractionTargets,
    anatomy_points,
)
from omomo_core.generation.collision.collision_config import (
    FOOT_SHIFT,
    HAND_TURN,
    LIMB_SWING,
    ROOT_SHIFT,
    SIDES,
)
from omomo_core.generation.solving.foot_plan import ANKLES, TOES, FootPlan
from omomo_core.generation.solving.solving_config import STEPS
from omomo_core.geometry.cheapest_path import cheapest_path
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.geometry.runs import runs
from omomo_core.skeleton import PALM_JOINTS, joint

Spheres = Float[Tensor, "samples seen balls 3"]
Cost = Float[Tensor, "samples seen choices"]
Places = Callable[[Tensor, Tensor, Tensor], Float[Tensor, "some choices 3"]]
"""Positions of some spheres by each choice, given their samples, frames and numbers; world, metres."""


@dataclass(frozen=True)
class CollisionAvoidance:
    """An object that a body has to avoid, at the evaluated frames."""

    anatomy: Anatomy
    field: DistanceField
    T_world_object: Float[Tensor, "seen 4 4"]
    seen: Int[np.ndarray, " seen"]
    free: Float[Tensor, " frames"]
    """How far each frame may be changed, from 0 to 1."""
    stride: int
    """Frames from one evaluated frame to the next."""

    @staticmethod
    def of(
        anatomy: Anatomy,
        field: DistanceField,
        T_world_object: Float[np.ndarray, "frames 4 4"],
        free: Float[Tensor, " frames"],
        stride: int = SIDES.stride,
    ) -> "CollisionAvoidance":
        """Return the object at every `stride`-th frame and the last one."""
        frames = len(T_world_object)
        seen = np.unique(np.append(np.arange(0, frames, stride), frames - 1))
        T = torch.from_numpy(T_world_object[seen]).float()
        return CollisionAvoidance(anatomy, field, T, seen, free, stride)

    def spheres(
        self,
        root: Float[Tensor, "samples seen 3"],
        rotations: Float[Tensor, "samples seen 22 3 3"],
    ) -> Spheres:
        """Return the centres of all collision spheres, world, metres."""
        points, _ = anatomy_points(self.anatomy, root.flatten(0, 1), rotations.flatten(0, 1))
        return points[:, 5:].unflatten(0, root.shape[:2])

    def collision_cost(
        self,
        now: Spheres,
        radii: Float[Tensor, " spheres"],
        far: float,
        places: Places,
        choices: int,
    ) -> Cost | None:
        """Return the penetration cost of each choice; None where nothing is inside the object now.

        Args:
            now: present spheres, world, metres.
            radii: their radii, metres.
            far: how far a choice moves any of them at most, metres.
            places: their positions by each choice.
            choices: how many choices there are.
        """
        clear = self._distance(now, self.T_world_object) - radii
        if not ((clear < 0) & (self.free[self.seen] > 0.5)[:, None]).any():
            return None
        # A sphere that is farther away than it can be moved is clear by any choice.
        sample, frame, ball = (clear < far).nonzero(as_tuple=True)
        at = places(sample, frame, ball)
        depth = radii[ball, None] - self._distance(at, self.T_world_object[frame])
        cost = now.new_zeros(*now.shape[:2], choices)
        return cost.index_put_((sample, frame), _squared_depth(depth), accumulate=True)

    def penetration_cost(
        self, at: Spheres, radii: Float[Tensor, " spheres"]
    ) -> Float[Tensor, "samples seen balls"]:
        """Return the cost of each sphere's penetration.

        Args:
            at: spheres, world, metres.
            radii: their radii, metres.
        """
        return _squared_depth(radii - self._distance(at, self.T_world_object))

    def _distance(
        self, at: Float[Tensor, "*b some 3"], T: Float[Tensor, "*c 4 4"]
    ) -> Float[Tensor, "*b some"]:
        """Return the signed distance of points to the object in the pose of their frame, metres."""
        return self.field.at((at - T[..., None, :3, 3]) @ T[..., :3, :3])

    def cheapest_values(
        self,
        cost: Cost,
        values: Float[Tensor, "choices n"],
        between: Float[Tensor, "*steps choices choices"],
    ) -> Float[Tensor, "samples seen n"]:
        """Return the values along the cheapest path; the first choice changes nothing.

        Args:
            cost: of each choice.
            values: of each choice.
            between: cost of a change, one for all steps or one for each (samples, seen - 1).
        """
        kept = self.free[self.seen] < 0.5
        cost = cost.clone()
        cost[:, kept, 1:] += SIDES.fixed
        return values[cheapest_path(cost, between)]

    def smoothed(
        self, chosen: Float[Tensor, "samples seen n"]
    ) -> Float[Tensor, "samples frames n"]:
        """Return the chosen values in every frame, each blended smoothly into the next."""
        return self._between.to(chosen) @ chosen * self.free[:, None]

    @cached_property
    def _between(self) -> Float[Tensor, "frames seen"]:
        frames = np.arange(len(self.free))
        shares = np.stack([np.interp(frames, self.seen, one) for one in np.eye(len(self.seen))], 1)
        return torch.from_numpy(gaussian_filter1d(shares, self.stride, axis=0, mode="nearest"))


def _squared_depth(depth: Tensor) -> Tensor:
    return SIDES.penetration * depth.clamp(min=0).square()


def level_shifts(step: float, farthest: float) -> Float[Tensor, "choices 3"]:
    """Return horizontal shifts on a grid within a circle, nearest first, metres."""
    count = round(farthest / step)
    axis = step * torch.arange(-count, count + 1)
    level = torch.cartesian_prod(axis, axis, torch.zeros(1))
    level = level[level.norm(dim=-1) < 1.001 * farthest]
    return level[level.norm(dim=-1).argsort(stable=True)]


def squared_distances(values: Float[Tensor, "choices n"]) -> Float[Tensor, "choices choices"]:
    """Return the squared distance from each choice to each."""
    return (values[:, None] - values).square().sum(dim=-1)


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
