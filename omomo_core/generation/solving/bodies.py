"""Solving of sampled bodies: planted feet stay in place, and holding palms are at their targets.

First root, hands, feet and limbs choose a side of the object (`generation/collision/`), and the pelvis moves
to where arms and legs reach. Then trajectory optimisation corrects the whole clip smoothly, against joint
ranges, the object's surface and loss of balance. At last arms and legs are solved exactly.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics, sole_points
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import (
    InteractionTargets,
    SolverTargets,
    build_anatomy,
    centre_of_mass,
)
from omomo_core.body.trajectory_optimization.solver import (
    blend_approach,
    firmness,
    optimise_trajectory,
)
from omomo_core.generation.collision.avoidance import (
    CollisionAvoidance,
    move_feet_clear,
    move_root_clear,
    swing_limbs_clear,
    turn_hands_clear,
)
from omomo_core.generation.collision.collision_config import SIDES
from omomo_core.generation.generation_options import SolvedPrefix, free_after
from omomo_core.generation.solving.foot_plan import ANKLES, TOES, FootPlan, plan_feet
from omomo_core.generation.solving.palm_plan import (
    ARMS,
    ankles_of,
    move_root_within_reach,
    solve_arms,
)
from omomo_core.generation.solving.solving_config import BODY_SOLVING, REACH, STEADY_LIMBS
from omomo_core.generation.solving.steady_limbs import steady_limbs
from omomo_core.geometry.runs import frames_away, min_jerk

_BEFORE, _OPTIMISING = 0.3, 0.5
"""Shares of the time before the trajectory optimisation, and in it."""
BATCH_FRAMES = 2400
"""Frames of all samples together that are optimised side by side: bounds memory."""
LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")


@dataclass(frozen=True)
class SolvedBodies:
    """Bodies whose feet and palms are at their targets, with how far palms miss them."""

    root: Float[Tensor, "samples frames 3"]
    rotations: Float[Tensor, "samples frames 22 3 3"]
    standing: Bool[np.ndarray, "samples frames 2"]
    """Left, right foot is planted."""
    miss: Float[Tensor, "samples frames 2"]
    """Distance of each palm from its target where it should hold, metres; 0 elsewhere."""

    @staticmethod
    def join(groups: "Sequence[SolvedBodies]") -> "SolvedBodies":
        """Return the samples of all groups."""
        return SolvedBodies(
            torch.cat([g.root for g in groups]),
            torch.cat([g.rotations for g in groups]),
            np.concatenate([g.standing for g in groups]),
            torch.cat([g.miss for g in groups]),
        )

    def prefix(self, rows: slice) -> SolvedPrefix:
        """Return the prefix of the next chunk, which begins with these frames."""
        return SolvedPrefix(self.root[:, rows], self.rotations[:, rows], self.standing[:, rows])


def solve_bodies(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    foot_contact: Float[Tensor, "samples frames 4"],
    targets: InteractionTargets,
    prefix: SolvedPrefix | None = None,
    free: Float[Tensor, " frames"] | None = None,
    on_progress: Callable[[float], None] = lambda done: None,
) -> SolvedBodies:
    """Return K samples of one clip with planted feet in place and holding palms at their targets.

    Args:
        body: whose bones.
        root: sampled pelvis, world, metres.
        rotations: sampled global rotations.
        foot_contact: probability that left ankle, right ankle, left toe, right toe is planted.
        targets: what hands hold, and the obstacle.
        prefix: the first frames, which stay as they are.
        free: how far pelvis and trunk of each frame may leave the sample, from 0 (not at all) to 1,
            smooth; everywhere 1 if not given.
        on_progress: called with the fraction done.
    """
    free = torch.ones(root.shape[1]) if free is None else free
    if prefix is not None:
        root, rotations = _continue_prefix(prefix, root, rotations)
        free = free * free_after(prefix.frames, root.shape[1])
    anatomy, field = build_anatomy(body, clearance=BODY_SOLVING.clearance), targets.obstacle.field
    avoidance = CollisionAvoidance.of(anatomy, field, targets.T_world_object, free)
    root = move_root_clear(
        body, root, solve_arms(body, root, rotations, targets), targets, avoidance
    )
    armed = solve_arms(body, root, rotations, targets)
    rotations, targets = turn_hands_clear(body, root, rotations, armed, targets, avoidance)
    feet = _plan_feet(body, root, rotations, foot_contact, prefix)
    pose = _Pose(root, _with_feet(rotations, feet))
    pose = replace(
        pose,
        root=move_root_within_reach(
            body, root, pose.rotations, feet, targets, free, REACH.first_stretch
        ),
    )
    pose = _solve_limbs(body, pose, feet, targets)
    feet = move_feet_clear(body, pose.root, pose.rotations, feet, avoidance)
    pose = _swing_clear(body, _solve_limbs(body, pose, feet, targets), avoidance)
    on_progress(_BEFORE)
    pose = _optimised(body, pose, feet, targets, avoidance, on_progress)
    feet = _free_feet(body, pose, feet)
    near = move_root_within_reach(
        body, pose.root, pose.rotations, feet, targets, free, REACH.last_stretch
    )
    pose = _solve_limbs(body, replace(pose, root=near), feet, targets)
    fine_avoidance = CollisionAvoidance.of(
        anatomy, field, targets.T_world_object, free, SIDES.fine_stride
    )
    pose = _with_steady_legs(body, _swing_clear(body, pose, fine_avoidance), feet, free)
    if prefix is not None:
        pose.root[:, : prefix.frames] = prefix.root
        pose.rotations[:, : prefix.frames] = prefix.rotations
    return _solved(body, pose, feet, targets)


@dataclass(frozen=True)
class _Pose:
    root: Float[Tensor, "samples frames 3"]
    rotations: Float[Tensor, "samples frames 22 3 3"]


def _solved(
    body: BodyModel, pose: _Pose, feet: Sequence[FootPlan], targets: InteractionTargets
) -> SolvedBodies:
    palms = forward_kinematics(body, pose.root, pose.rotations)[..., 22:, :]
    miss = (palms - targets.palms).norm(dim=-1)
    return SolvedBodies(
        pose.root,
        pose.rotations,
        np.stack([f.standing for f in feet]),
        torch.where(targets.hold > BODY_SOLVING.full_hold, miss, 0.0),
    )


def _continue_prefix(
    prefix: SolvedPrefix, root: Tensor, rotations: Tensor
) -> tuple[Float[Tensor, "samples frames 3"], Float[Tensor, "samples frames 22 3 3"]]:
    """Return bodies that begin with the prefix; the change of its last frame fades out after it."""
    first = prefix.frames
    weight = (1 - free_after(first, root.shape[1]))[:, None]
    step = roma.rotmat_to_rotvec(rotations[:, first - 1].mT @ prefix.rotations[:, -1])
    turned = rotations @ roma.rotvec_to_rotmat(weight[..., None] * step[:, None])
    moved = root + weight * (prefix.root[:, -1:] - root[:, first - 1 : first])
    turned[:, :first], moved[:, :first] = prefix.rotations, prefix.root
    return moved, turned


def continue_hands(body: BodyModel, solved: SolvedBodies, before: SolvedPrefix) -> SolvedBodies:
    """Return bodies that begin with a prefix whose hands are laid, which turned its arms.

    The change of its last frame fades out after it. Palms stay at their targets, but for what the last of the
    prefix was off.

    Args:
        body: whose bones.
        solved: the same bodies, solved from the prefix before its hands were laid.
        before: the prefix.
    """
    first, frames = before.frames, solved.root.shape[1]
    palms = forward_kinematics(body, solved.root, solved.rotations)[..., 22:, :]
    laid = forward_kinematics(body, before.root[:, -1:], before.rotations[:, -1:])[..., 22:, :]
    away = (1 - free_after(first, frames))[:, None, None].to(palms)
    palms = palms + away * (laid - palms[:, first - 1 : first])
    _, rotations = _continue_prefix(before, solved.root, solved.rotations)
    for side in range(2):
        goal = palms[..., side, :]
        rotations, _ = reach(body, solved.root, rotations, ARMS[side], goal, gently=True)
    rotations[:, :first] = before.rotations
    return replace(solved, rotations=rotations)


def _plan_feet(
    body: BodyModel,
    root: Tensor,
    rotations: Tensor,
    foot_contact: Tensor,
    prefix: SolvedPrefix | None,
) -> list[FootPlan]:
    joints = forward_kinematics(body, root, rotations).double().numpy()
    R, down = rotations.double().numpy(), foot_contact.numpy()
    stood = [None] * len(R) if prefix is None else prefix.standing
    return [plan_feet(body, joints[k], R[k], down[k], stood[k]) for k in range(len(R))]


def _with_feet(
    rotations: Float[Tensor, "samples frames 22 3 3"], feet: list[FootPlan]
) -> Float[Tensor, "samples frames 22 3 3"]:
    planned = np.stack([f.rotations for f in feet]).swapaxes(2, 3)
    turned = rotations.clone()
    turned[:, :, (*ANKLES, *TOES)] = torch.from_numpy(planned).to(rotations).flatten(2, 3)
    return turned


def _solve_limbs(
    body: BodyModel, pose: _Pose, feet: list[FootPlan], targets: InteractionTargets
) -> _Pose:
    ankles, rotations = ankles_of(feet), pose.rotations
    for side in range(2):
        goal = ankles[..., side, :]
        rotations, _ = reach(body, pose.root, rotations, LEGS[side], goal, gently=True)
    return replace(pose, rotations=solve_arms(body, pose.root, rotations, targets))


def _swing_clear(body: BodyModel, pose: _Pose, avoidance: CollisionAvoidance) -> _Pose:
    return replace(pose, rotations=swing_limbs_clear(body, pose.root, pose.rotations, avoidance))


def _with_steady_legs(
    body: BodyModel, pose: _Pose, feet: Sequence[FootPlan], free: Float[Tensor, " frames"]
) -> _Pose:
    apart = np.stack([[frames_away(foot) for foot in f.standing.T] for f in feet]).swapaxes(1, 2)
    held = 1 - min_jerk(apart / STEADY_LIMBS.foot_ramp)
    return replace(pose, rotations=steady_limbs(body, pose.root, pose.rotations, LEGS, held, free))


def _free_feet(body: BodyModel, pose: _Pose, feet: list[FootPlan]) -> list[FootPlan]:
    """Return foot plans whose swings follow the optimised trajectory."""
    joints = forward_kinematics(body, pose.root, pose.rotations).double().numpy()
    found, planned = joints[..., ANKLES, :], np.stack([f.ankles for f in feet])
    firm = firmness(np.stack([f.standing for f in feet]))[..., None]
    return [
        replace(f, ankles=way)
        for f, way in zip(feet, found + firm * (planned - found), strict=True)
    ]


def _optimised(
    body: BodyModel,
    pose: _Pose,
    feet: list[FootPlan],
    targets: InteractionTargets,
    avoidance: CollisionAvoidance,
    on_progress: Callable[[float], None],
) -> _Pose:
    """Return every sample after trajectory optimisation, as many side by side as memory should hold."""
    samples, frames = pose.root.shape[:2]
    solver_targets, count = (
        _solver_targets(body, pose, feet, targets),
        max(1, BATCH_FRAMES // frames),
    )
    root, rotations = pose.root.double().numpy(), pose.rotations.double().numpy()
    solved = [
        optimise_trajectory(
            body,
            root[some],
            rotations[some],
            solver_targets.select(some),
            anatomy=avoidance.anatomy,
            free=avoidance.free.numpy(),
            steps=BODY_SOLVING.iterations,
            on_progress=lambda done, k=k: on_progress(
                _BEFORE + _OPTIMISING * min((k + count * done) / samples, 1.0)
            ),
        )
        for k in range(0, samples, count)
        for some in (slice(k, k + count),)
    ]
    return _Pose(
        *(torch.from_numpy(np.concatenate([s[i] for s in solved])).float() for i in (0, 1))
    )


def _solver_targets(
    body: BodyModel, pose: _Pose, feet: list[FootPlan], targets: InteractionTargets
) -> SolverTargets:
    root, rotations = (x.double().flatten(0, 1).numpy() for x in (pose.root, pose.rotations))
    soles = sole_points(body, root, rotations).reshape(*pose.root.shape[:2], 4, 3)
    standing, rolling = (
        np.stack(of) for of in zip(*((f.standing, f.rolling) for f in feet), strict=True)
    )
    joints = forward_kinematics(body, pose.root, pose.rotations).double().numpy()
    wanted = SolverTargets(
        palms=targets.palms.double().numpy(),
        R_world_wrist=targets.R_world_wrist.double().numpy(),
        hold=targets.hold.double().numpy(),
        ankles=np.stack([f.ankles for f in feet]),
        soles=soles,
        planted=np.concatenate([standing & ~rolling, standing], axis=-1),
        centre=centre_of_mass(joints),
        T_world_object=targets.T_world_object,
        obstacle=targets.obstacle,
        balance=targets.balance,
        carried_mass=0.0,
    )
    return blend_approach(body, pose.root.double().numpy(), pose.rotations.double().numpy(), wanted)
