"""A motion on another skeleton: proportions fitted, rotations carried over, feet where they were.

The object is not scaled and stays where it is, so the person keeps their place on the floor; the hips are
as high as the legs are long. Where arms or legs would not reach, hips and footholds move (footholds.py).

At rest ours is a T-pose; theirs may hold arms and legs otherwise. Limbs are turned to our rest
directions, the trunk keeps their shape (and feet their pitch: they stand flat in both). Only SMPL-X has a
chest where ours is, which tells how far its T-pose raises the shoulders.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Bool, Float, Int

from capture_app.exports.bones import global_rotations, skin_of
from capture_app.exports.contact_spans import contact_spans
from capture_app.exports.exported_take import Y_UP, Take, pose, rest_locals
from capture_app.exports.footholds import (
    HIPS,
    LimbTargets,
    leg_length,
    raised_shoulders,
    within_reach,
)
from capture_app.exports.resample import ANKLES, ARMS, LEGS, TOES, Sampled, solved
from capture_app.exports.target_skeleton import Target
from omomo_core.body.kinematics import (
    COLLARS,
    full_kinematics,
    joints_of,
    rest_offsets,
    rest_turns,
    skin,
)
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import min_jerk, runs
from omomo_core.geometry.surface import inside_mesh
from omomo_core.geometry.transforms import shortest_turn, to_local
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS, joint

_LIMBS = {
    f"{side}_{start}": f"{side}_{end}"
    for side in ("left", "right")
    for start, end in (
        ("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"),
        ("wrist", "middle1"),
        *((f"{f}{k}", f"{f}{k + 1}") for f in ("index", "middle", "pinky", "ring", "thumb")
          for k in (1, 2)),
    )
}  # fmt: skip
"""Joints that drive one straight bone, and the end of that bone."""
_FEET = {f"{side}_ankle": f"{side}_foot" for side in ("left", "right")}
_TRUNK = ("collar", "hip", "ankle")
"""Joints at which turns of the joint above end: these keep their own attitude at rest."""


@dataclass(frozen=True)
class Proportions:
    """A target as one of our bodies."""

    body: BodyModel
    """In the T-pose; joints the target lacks lie in those they hang on, or stick out as ours do."""
    turns: Float[np.ndarray, "52 3 3"]
    """What brings each joint from the target's rest pose to the T-pose, in our rest axes."""
    driven: Int[np.ndarray, "52"]
    """The joint that moves the bone each joint belongs to: itself, or what the target has above it."""


def proportions(target: Target, body: BodyModel) -> Proportions:
    """Fit our body to a target.

    Args:
        target: standing at rest.
        body: ours, for its T-pose, its skin and what the target lacks.
    """
    theirs = {n: Y_UP @ target.skeleton.positions[k] for n, k in target.joints.items()}
    ours = body.rest_joints.double().numpy()
    driven = _driven(theirs)
    collars = {} if target.smplx is None else _shoulders_down(body, target.smplx)
    turns = _turns(theirs, ours, driven, collars)
    leg = _length(theirs, "hip", "knee", "ankle") / _own_length(ours, "hip", "knee", "ankle")
    rest = np.zeros((52, 3))
    rest[0] = theirs["pelvis"]
    for j in range(1, 52):
        rest[j] = _placed(j, rest, theirs, ours, turns, driven, leg)
    fitted = target.smplx or body
    moved = torch.from_numpy(rest).float()
    vertices = _with_joints(fitted, target, turns, moved)
    return Proportions(replace(fitted, rest_joints=moved, vertices=vertices), turns, driven)


def at_rest(shape: Proportions) -> BodyModel:
    """The fitted body in the target's own rest pose, for its skin; y up."""
    back = torch.from_numpy(shape.turns.swapaxes(1, 2).copy())
    joints, R = _posed(shape.body, back)
    return replace(
        shape.body, rest_joints=joints.float(), vertices=skin(shape.body, joints, R).float()
    )


def _posed(body: BodyModel, R: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Joints of the body and their global rotations (52, 3, 3)."""
    local = R[list(ALL_PARENTS[22:])].mT @ R[22:]
    return full_kinematics(body, body.rest_joints[0].double(), R[:22], local)


def _driven(theirs: Mapping[str, Float[np.ndarray, "3"]]) -> Int[np.ndarray, "52"]:
    driven = np.zeros(52, int)
    for j, name in enumerate(ALL_JOINTS):
        driven[j] = j if name in theirs else driven[ALL_PARENTS[j]]
    return driven


def _turns(
    theirs: Mapping[str, Float[np.ndarray, "3"]],
    ours: Float[np.ndarray, "52 3"],
    driven: Int[np.ndarray, "52"],
    collars: Mapping[int, Float[np.ndarray, "3 3"]],
) -> Float[np.ndarray, "52 3 3"]:
    turns = np.tile(np.eye(3), (52, 1, 1))
    for j, name in enumerate(ALL_JOINTS):
        above = turns[ALL_PARENTS[j]] if j and not name.endswith(_TRUNK) else np.eye(3)
        end = _LIMBS.get(name) or _FEET.get(name)
        turns[j] = turns[driven[j]] if driven[j] != j else collars.get(j, above)
        if end is None or name not in theirs or end not in theirs:
            continue
        have, want = above @ (theirs[end] - theirs[name]), ours[joint(end)] - ours[j]
        if name in _FEET:
            have, want = have * [1.0, 0.0, 1.0], want * [1.0, 0.0, 1.0]
        turns[j] = shortest_turn(have, want) @ above
    return turns


def _shoulders_down(body: BodyModel, smplx: BodyModel) -> dict[int, Float[np.ndarray, "3 3"]]:
    """Return what brings its shoulders to where ours are, of each collar."""
    turns = rest_turns(body, rest_offsets(smplx))
    return {collar: turns[collar].T for collar in COLLARS}


def _placed(
    j: int,
    rest: Float[np.ndarray, "52 3"],
    theirs: Mapping[str, Float[np.ndarray, "3"]],
    ours: Float[np.ndarray, "52 3"],
    turns: Float[np.ndarray, "52 3 3"],
    driven: Int[np.ndarray, "52"],
    leg: float,
) -> Float[np.ndarray, "3"]:
    """Return the position of a joint in the T-pose."""
    parent, name = ALL_PARENTS[j], ALL_JOINTS[j]
    above = int(driven[parent])
    if name in theirs:
        return rest[above] + turns[above] @ (theirs[name] - theirs[ALL_JOINTS[above]])
    if name.endswith(("spine1", "spine2", "spine3", "neck", "collar")):
        return rest[parent]
    return rest[parent] + leg * (ours[j] - ours[parent])


def _with_joints(
    body: BodyModel,
    target: Target,
    turns: Float[np.ndarray, "52 3 3"],
    rest: Float[torch.Tensor, "52 3"],
) -> Float[torch.Tensor, "verts 3"]:
    """A surface that goes along: the model's own, in the T-pose; ours, stretched with the joints."""
    if target.smplx is None:
        moves = rest - body.rest_joints
        return body.vertices + (body.skin_weights[..., None] * moves[body.skin_joints]).sum(dim=1)
    _, R = _posed(body, torch.from_numpy(turns))
    return skin(body, rest.double(), R).float()


def _length(at: Mapping[str, Float[np.ndarray, "3"]], *parts: str) -> float:
    chain = [at[f"left_{part}"] for part in parts]
    return float(sum(np.linalg.norm(b - a) for a, b in pairwise(chain)))


def _own_length(rest: Float[np.ndarray, "52 3"], *parts: str) -> float:
    return _length({f"left_{p}": rest[joint(f"left_{p}")] for p in parts}, *parts)


_BLEND = 8 / FPS
"""Seconds over which a hand goes from its own way onto the object and back."""
_HEAD = (joint("neck"), joint("head"))
_TOLD = 0.01
"""Metres by which a hand or foot may be off without a note."""

_Points = Float[np.ndarray, "frames 3"]
_Turns = Float[np.ndarray, "frames 22 3 3"]


def take_on_target(
    sampled: Sampled, body: BodyModel, target: Target
) -> tuple[Take, tuple[str, ...]]:
    """Put a motion on another skeleton.

    Args:
        sampled: the motion at the rate to be written.
        body: whose bones it moves.
        target: the other skeleton.

    Returns:
        The take on the target's bones, and what it could not keep, in sentences.
    """
    shape = proportions(target, body)
    human, notes = refit(sampled, body, shape, _toe_height(target, shape))
    bones, moved = target.skeleton, sampled.object_motion
    R = _target_rotations(
        global_rotations(replace(sampled, human=human), shape.body), shape, target
    )
    index = np.array([target.joints[ALL_JOINTS[j]] for j in shape.driven])
    take = Take(
        fps=sampled.fps,
        skeleton=bones,
        skin=skin_of(at_rest(shape), index, np.zeros(3)),
        body=f"{shape.body.name} on {target.name}",
        credit=shape.body.credit,
        positions=pose(bones, human.root.astype(np.float64), R),
        rotations=R,
        mesh=moved.mesh,
        T_world_object=moved.T_world_object,
        hand_contact=human.hand_contact > 0.5,
        foot_contact=human.foot_contact > 0.5,
        spans=contact_spans(sampled),
        human=target.joints,
    )
    return take, notes


def refit(
    sampled: Sampled, body: BodyModel, shape: Proportions, toe_height: float
) -> tuple[HumanMotion, tuple[str, ...]]:
    """The motion on the fitted body.

    Args:
        sampled: the motion on `body`.
        body: ours.
        shape: the target as one of our bodies.
        toe_height: of the target's toe joints when it stands, metres.
    """
    human, fitted = sampled.human, shape.body
    turned = human.rotations[:, shape.driven[:22]].astype(np.float64)
    ankles = _ankles(human, body, fitted, turned, toe_height)
    palms = human.joints[:, 22:].astype(np.float64)
    hold = _hold(human.hand_contact > 0.5, sampled.fps)
    stands = (human.foot_contact[:, :2] > 0.5) | (human.foot_contact[:, 2:] > 0.5)
    start = _scaled_root(human, body, fitted, turned)
    targets = LimbTargets(ankles, stands, palms, hold)
    root, ankles = within_reach(fitted, start, turned, targets, sampled.fps)
    if set(COLLARS) <= set(shape.driven):
        turned = raised_shoulders(fitted, root, turned, targets)
    for side in range(2):
        turned = solved(fitted, root, turned, LEGS[side], ankles[:, side])
        turned = solved(fitted, root, turned, ARMS[side], palms[:, side], hold[:, side])
    turned = turned[:, shape.driven[:22]]
    joints = joints_of(fitted, root, turned)
    notes = (*_notes(joints, ankles, palms, human), *_head_notes(sampled, joints))
    posed = replace(
        human,
        root=root.astype(np.float32),
        rotations=turned.astype(np.float32),
        joints=joints.astype(np.float32),
    )
    return posed, notes


def _toe_height(target: Target, shape: Proportions) -> float:
    toe = target.joints.get("left_foot")
    if toe is not None:
        return float(target.skeleton.positions[toe, 2])
    rest = shape.body.rest_joints
    drop = float(rest[TOES[0], 1] - rest[ANKLES[0], 1])
    return float(target.skeleton.positions[target.joints["left_ankle"], 2]) + drop


def _target_rotations(
    R: Float[np.ndarray, "frames 52 3 3"], shape: Proportions, target: Target
) -> Float[np.ndarray, "frames joints 3 3"]:
    """R_world_joint of the target's joints; those that are none of ours go along rigidly."""
    bones, local = target.skeleton, rest_locals(target.skeleton).rotations
    ours = {k: ALL_JOINTS.index(name) for name, k in target.joints.items()}
    out = np.tile(bones.rotations, (len(R), 1, 1, 1))
    for k, parent in enumerate(bones.parents):
        if k in ours:
            out[:, k] = R[:, ours[k]] @ (shape.turns[ours[k]] @ Y_UP @ bones.rotations[k])
        elif k not in bones.travelling:
            out[:, k] = out[:, parent] @ local[k]
    return out


def _ankles(
    human: HumanMotion, body: BodyModel, fitted: BodyModel, R: _Turns, toe_height: float
) -> Float[np.ndarray, "frames 2 3"]:
    """Return the ankles that put the toes where ours are: flat and rolling feet stand still."""
    level = float(body.rest_joints[TOES[0], 1] - body.vertices[:, 1].min())
    rest = fitted.rest_joints.double().numpy()
    out = np.zeros((len(R), 2, 3))
    for side in range(2):
        toe = human.joints[:, TOES[side]] + np.array([0.0, 0.0, toe_height - level])
        out[:, side] = toe - R[:, ANKLES[side]] @ (rest[TOES[side]] - rest[ANKLES[side]])
    return out


def _scaled_root(human: HumanMotion, body: BodyModel, fitted: BodyModel, R: _Turns) -> _Points:
    """The pelvis with the hips over the same place, as high as the legs are longer."""
    rest = fitted.rest_joints.double().numpy()
    middle = human.joints[:, HIPS].mean(axis=1).astype(np.float64)
    middle[:, 2] *= leg_length(fitted) / leg_length(body)
    return middle - R[:, 0] @ (rest[list(HIPS)].mean(axis=0) - rest[0])


def _hold(contact: Bool[np.ndarray, "frames 2"], fps: float) -> Float[np.ndarray, "frames 2"]:
    """1 where a hand holds, easing to 0 around it."""
    frames = np.arange(len(contact))
    away = np.full(contact.shape, np.inf)
    for side in range(2):
        for start, stop in runs(contact[:, side]):
            near = np.maximum(start - frames, frames - (stop - 1)).clip(min=0)
            away[:, side] = np.minimum(away[:, side], near)
    return min_jerk(1.0 - away / (_BLEND * fps))


def _notes(
    joints: Float[np.ndarray, "frames 24 3"],
    ankles: Float[np.ndarray, "frames 2 3"],
    palms: Float[np.ndarray, "frames 2 3"],
    human: HumanMotion,
) -> tuple[str, ...]:
    held, planted = human.hand_contact > 0.5, human.foot_contact[:, :2] > 0.5
    off = {
        "hand that holds": np.linalg.norm(joints[:, 22:] - palms, axis=-1)[held],
        "foot that stands": np.linalg.norm(joints[:, ANKLES] - ankles, axis=-1)[planted],
    }
    return tuple(
        f"This skeleton does not reach everywhere: a {what} is up to {100 * miss.max():.0f} cm off."
        for what, miss in off.items()
        if miss.max(initial=0.0) > _TOLD
    )


def _head_notes(sampled: Sampled, joints: Float[np.ndarray, "frames 24 3"]) -> tuple[str, ...]:
    """Return a sentence that says for how long the head is inside the object and was not before."""
    enters = _head_inside(sampled.object_motion, joints)
    enters &= ~_head_inside(sampled.object_motion, sampled.human.joints)
    if not enters.any():
        return ()
    seconds = enters.sum() / sampled.fps
    return (f"On this skeleton the head is inside the object for {seconds:.1f} s.",)


def _head_inside(
    moved: ObjectMotion, joints: Float[np.ndarray, "frames 24 3"]
) -> Bool[np.ndarray, " frames"]:
    points = to_local(moved.T_world_object, joints[:, _HEAD].astype(np.float64)).reshape(-1, 3)
    inside = inside_mesh(moved.mesh, points).reshape(-1, len(_HEAD))
    return inside[:, 0] | inside[:, 1]
