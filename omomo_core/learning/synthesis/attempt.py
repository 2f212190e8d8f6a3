"""One attempt at a synthetic clip: plan it, pose the hands, perform it, solve it, and check it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.obstacle import BoxObstacle
from omomo_core.body.trajectory_optimization.residuals import SolverTargets, centre_of_mass
from omomo_core.body.trajectory_optimization.solver import keep_approach, optimise_trajectory
from omomo_core.learning.recordings.clips import SYNTHESIS, Clip
from omomo_core.learning.recordings.grounding import foot_contacts
from omomo_core.learning.synthesis.action_plan import Action
from omomo_core.learning.synthesis.actions import draw_action_plan
from omomo_core.learning.synthesis.actor import ActorMotion, solve_actor
from omomo_core.learning.synthesis.base_motion import BaseMotion, about_z, goes_its_way, heading
from omomo_core.learning.synthesis.base_motion_search import (
    ClipPlan,
    MotionRequirements,
    Sources,
    find_base_motion,
)
from omomo_core.learning.synthesis.cart_use import cart_trajectory, trolley_trajectory
from omomo_core.learning.synthesis.holds import Handling, Posture
from omomo_core.learning.synthesis.palms_on_prop import Hands, along_forearms, plan_hands
from omomo_core.learning.synthesis.props import Prop, Stock, make_prop, scaled
from omomo_core.learning.synthesis.review import fault, walked_through
from omomo_core.learning.synthesis.shapes import SolidPart
from omomo_core.learning.synthesis.tool_use import (
    PROPS,
    ToolAction,
    draw_tool_use,
    stroke_trajectory,
)
from omomo_core.learning.synthesis.trajectory import both_come, prop_trajectory
from omomo_core.learning.synthesis.walker.footsteps import Chances
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.skeleton import joint

_SHORTEST_HOLD = 45
"""Frames for which the prop must be held; shorter clips teach little."""

_ANKLES = (joint("left_ankle"), joint("right_ankle"))

_PROP_TRIES = 60
_DIRECTORS = {"trolley": trolley_trajectory, "cart": cart_trajectory}
_STROLL: Chances = {"walk": 0.3, "shuffle": 0.4, "side": 0.15, "back": 0.15}
_AHEAD: Chances = {"walk": 1.0}
_TOOL_ACTIONS: tuple[ToolAction, ...] = get_args(ToolAction)


@dataclass(frozen=True)
class SynthesisedClip:
    """The parts of an accepted clip."""

    licence: str
    action: str
    prop: Prop
    handling: Handling
    hands: Hands
    performance: ActorMotion


def attempt(
    rng: np.random.Generator, sources: Sources, body: BodyModel, action: Action, scale: float
) -> SynthesisedClip | str:
    """Try to synthesise a clip; return its parts, or the reason why it was rejected.

    Args:
        rng: source of all randomness.
        sources: the mocap and the props that clips are made from.
        body: whose proportions the clip has.
        action: the action to perform.
        scale: our stature over the actor's.
    """
    plan = (
        _plan_tool_work(rng, sources, action, body, scale)
        if action in _TOOL_ACTIONS
        else _plan_handling(rng, sources, body, action, scale)
    )
    if isinstance(plan, str):
        return plan
    base_motion, prop, handling = plan.base_motion, plan.prop, plan.handling
    if walked_through(body, base_motion, prop, handling):
        return "walked-through"
    hands = plan_hands(handling, heading(base_motion.rotations))
    performance = solve_actor(body, base_motion, plan.posture, hands)
    if any(hold.fingers is None for hold in handling.holds):
        joints = joints_of(body, performance.root, performance.rotations)
        hands = plan_hands(along_forearms(handling, joints))
        performance = solve_actor(body, base_motion, plan.posture, hands)
    if not np.isfinite(performance.root).all():
        return "broken"
    performance = _optimised(body, plan, hands, performance)
    reason = fault(body, base_motion, prop, handling, hands, performance)
    return reason or SynthesisedClip(plan.licence, action, prop, handling, hands, performance)


def _plan_handling(
    rng: np.random.Generator, sources: Sources, body: BodyModel, action: Action, scale: float
) -> ClipPlan | str:
    """Plan an action of the grammar; return the reason where that fails."""
    action_plan = draw_action_plan(rng, action, scale, sources.stock)
    if action_plan is None:
        return "no-prop"

    def suits(base_motion: BaseMotion) -> bool:
        spans = action_plan.spans(base_motion.pauses)
        long_enough = sum(last - first for first, last in spans) >= _SHORTEST_HOLD
        long_enough &= all(map(both_come, action_plan.episodes, spans))
        return long_enough and goes_its_way(base_motion, spans, action_plan.wanted.way)

    found = find_base_motion(rng, sources, action_plan.wanted, suits)
    if found is None:
        return "no-stage"
    slides = all(episode.slides for episode in action_plan.episodes)
    handling = prop_trajectory(rng, body, found[0], action_plan)
    return ClipPlan(*found, action_plan.prop, handling, action_plan.posture, leant_on=slides)


def _optimised(
    body: BodyModel, plan: ClipPlan, hands: Hands, performance: ActorMotion
) -> ActorMotion:
    """Return the performance after trajectory optimisation."""
    base_motion = plan.base_motion
    targets = targets_of(
        body,
        (base_motion.root, base_motion.rotations),
        hands,
        plan.handling.T_world_prop,
        plan.prop.parts,
        load=0.0 if plan.leant_on else plan.prop.mass,
        leant_on=plan.leant_on,
    )
    initial = performance.root, performance.rotations
    root, rotations = optimise_trajectory(body, *initial, keep_approach(body, *initial, targets))
    joints = joints_of(body, root, rotations)
    residual = np.linalg.norm(joints[:, 22:] - hands.palms, axis=-1) * hands.contact
    return ActorMotion(root, rotations, residual)


def finished(
    rng: np.random.Generator, body: BodyModel, take: SynthesisedClip, person: int, number: str
) -> Clip:
    """Return the training clip of an accepted attempt: feet labelled, the origin at the first frame.

    Args:
        rng: source of all randomness.
        body: whose proportions the clip has.
        take: the parts of the clip.
        person: who acts.
        number: distinguishes the clip from others of this person.
    """
    handling, performance = take.handling, take.performance
    soles = sole_points(body, performance.root, performance.rotations)
    mesh, T_object_prop = _mesh(rng, take.prop)
    T_world_object = handling.T_world_prop @ np.linalg.inv(T_object_prop)
    centre = np.array([*performance.root[0, :2], 0.0])
    T_world_object[:, :3, 3] -= centre
    return Clip(
        name=f"sub{person}_{take.prop.name}_{number} {take.action}",
        source=SYNTHESIS,
        licence=take.licence,
        root=performance.root - centre,
        rotations=performance.rotations,
        hand_contact=take.hands.contact,
        foot_contact=foot_contacts(soles).astype(float),
        object_motion=ObjectMotion(mesh, T_world_object, np.ones(len(T_world_object), bool)),
    )


def _mesh(rng: np.random.Generator, prop: Prop) -> tuple[ObjectMesh, Float[np.ndarray, "4 4"]]:
    """Return the prop's surface in a random object frame (origin near the prop, any yaw), and that frame."""
    scan = prop.mesh(rng)
    yaw = rng.uniform(-np.pi, np.pi)
    T = np.eye(4)
    T[:3, :3] = about_z(np.array(yaw))
    middle = (prop.low + prop.high) / 2
    T[:3, 3] = -T[:3, :3] @ middle + rng.normal(0.0, 0.05, 3)
    moved = scan.vertices @ T[:3, :3].T + T[:3, 3]
    return ObjectMesh(moved, scan.faces, scan.name), T


def targets_of(
    body: BodyModel,
    base: tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]],
    hands: Hands,
    T_world_prop: Float[np.ndarray, "frames 4 4"],
    parts: Sequence[SolidPart],
    *,
    load: float = 0.0,
    leant_on: bool = False,
) -> SolverTargets:
    """Return the solver targets of one clip.

    Args:
        body: whose feet stand.
        base: root and global rotations of the motion whose feet are kept.
        hands: targets of the hands.
        T_world_prop: where the prop is.
        parts: what the prop is made of.
        load: its mass, kilograms, where it is lifted.
        leant_on: the prop is pushed or pulled, so the body may lean while a hand is on it.
    """
    root, rotations = base
    soles, joints = sole_points(body, root, rotations), joints_of(body, root, rotations)
    lean = hands.pull.max(axis=1) if leant_on else np.zeros(len(root))
    return SolverTargets(
        palms=hands.palms,
        R_world_wrist=hands.R_world_wrist,
        hold=hands.pull,
        ankles=joints[:, _ANKLES],
        soles=soles,
        planted=foot_contacts(soles),
        centre=centre_of_mass(joints),
        T_world_object=T_world_prop,
        obstacle=_boxes_of(parts),
        balance=1.0 - lean,
        carried_mass=load,
    )


def _boxes_of(parts: Sequence[SolidPart]) -> BoxObstacle:
    """Return the boxes that a prop fills."""
    corners = (np.stack([part.low for part in parts]), np.stack([part.high for part in parts]))
    return BoxObstacle(*(torch.as_tensor(c, dtype=torch.float32) for c in corners))


def _plan_tool_work(
    rng: np.random.Generator, sources: Sources, action: ToolAction, body: BodyModel, scale: float
) -> ClipPlan | str:
    """Plan work with a tool or something on wheels; return the reason where that fails."""
    frames = int(rng.uniform(120, 300))
    rolls = action in _DIRECTORS
    tools = Stock(frozenset({PROPS[action]}))
    for _ in range(_PROP_TRIES):
        prop = scaled(make_prop(rng, "push" if rolls else "tool", tools), scale)
        job = draw_tool_use(rng, action, prop, frames)
        if job is not None and sum(job.pause_frames) < frames - 40:
            break
    else:
        return "no-prop"
    wanted = MotionRequirements(
        frames,
        job.pause_frames,
        rate=(0.6, 1.0) if rolls else (0.4, 0.7),
        backward=0.3 if action == "cart" else 0.0,
        moves=_AHEAD if rolls else _STROLL,
    )
    trajectory_of, handlings = _DIRECTORS.get(action, stroke_trajectory), list[Handling]()

    def suits(base_motion: BaseMotion) -> bool:
        handling = trajectory_of(rng, body, base_motion, job)
        handlings.extend([handling] if handling is not None else [])
        return handling is not None

    found = find_base_motion(rng, sources, wanted, suits)
    if found is None:
        return "no-way"
    handling = handlings[-1]
    posture = Posture(squat=rng.uniform(0.0, 0.5), lean=rng.uniform(0.0, 0.2))
    return ClipPlan(*found, prop, handling, posture, leant_on=rolls)
