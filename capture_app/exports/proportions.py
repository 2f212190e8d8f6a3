"""Our body with another skeleton's bones, so that a rotation means the same to both.

At rest ours is a T-pose; theirs may hold arms and legs otherwise. Limbs are turned to our rest
directions, the trunk keeps their shape (and feet their pitch: they stand flat in both). Only SMPL-X has a
chest where ours is, which tells how far its T-pose raises the shoulders.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float, Int

from capture_app.exports.take import Y_UP
from capture_app.exports.target import Target
from omomo_core.body.kinematics import COLLARS, full_kinematics, rest_offsets, rest_turns, skin
from omomo_core.body.model import BodyModel
from omomo_core.geometry.transforms import shortest_turn
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
"""Where turns of the joint above end: these keep their own attitude at rest."""


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
    """What brings its shoulders to where ours are, of each collar."""
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
    """Where a joint is in the T-pose."""
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
