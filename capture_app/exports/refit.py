"""A motion on another skeleton: rotations carried over, feet where they stood, hands on the object.

The object is not scaled and stays where it is, so the person keeps their place on the floor; the hips are
as high as the legs are long, and are moved where arms or legs would not reach.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from capture_app.exports.own_bones import global_rotations, skin_of
from capture_app.exports.proportions import Proportions, at_rest, proportions
from capture_app.exports.resample import ANKLES, ARMS, LEGS, TOES, Sampled, solved
from capture_app.exports.take import Y_UP, Take, pose, rest_locals
from capture_app.exports.target import Target
from omomo_core.body.body_config import LIMB
from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import min_jerk, runs
from omomo_core.motion import FPS, HumanMotion
from omomo_core.skeleton import ALL_JOINTS

_HIPS, _SHOULDERS = (1, 2), (16, 17)
_BLEND = 8 / FPS
"""Seconds over which a hand goes from its own way onto the object and back."""
_WITHIN = LIMB.stretch
"""Share of a straight limb's length that the hips are moved to stay within."""
_ROUNDS = 10
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
    root = _within_reach(
        fitted, _scaled_root(human, body, fitted, turned), turned, ankles, palms, hold
    )
    for side in range(2):
        turned = solved(fitted, root, turned, LEGS[side], ankles[:, side])
        turned = solved(fitted, root, turned, ARMS[side], palms[:, side], hold[:, side])
    turned = turned[:, shape.driven[:22]]
    joints = joints_of(fitted, root, turned)
    notes = _notes(joints, ankles, palms, human)
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
    """Where ankles must be for the toes to be where ours are: flat and rolling feet stand still."""
    level = float(body.rest_joints[TOES[0], 1] - body.vertices[:, 1].min())
    rest = fitted.rest_joints.double().numpy()
    out = np.zeros((len(R), 2, 3))
    for side in range(2):
        toe = human.joints[:, TOES[side]] + np.array([0.0, 0.0, toe_height - level])
        out[:, side] = toe - R[:, ANKLES[side]] @ (rest[TOES[side]] - rest[ANKLES[side]])
    return out


def _scaled_root(human: HumanMotion, body: BodyModel, fitted: BodyModel, R: _Turns) -> _Points:
    """The pelvis with the hips over the same place, as high as the legs are longer."""
    ours, theirs = (b.rest_joints.double().numpy() for b in (body, fitted))
    middle = human.joints[:, _HIPS].mean(axis=1).astype(np.float64)
    middle[:, 2] *= _leg(theirs) / _leg(ours)
    return middle - R[:, 0] @ (theirs[list(_HIPS)].mean(axis=0) - theirs[0])


def _leg(rest: Float[np.ndarray, "52 3"]) -> float:
    return _limb(rest, 1, 4, 7)


def _limb(rest: Float[np.ndarray, "52 3"], *chain: int) -> float:
    return float(np.linalg.norm(np.diff(rest[list(chain)], axis=0), axis=1).sum())


def _hold(contact: Bool[np.ndarray, "frames 2"], fps: float) -> Float[np.ndarray, "frames 2"]:
    """1 where a hand holds, easing to 0 around it."""
    frames = np.arange(len(contact))
    away = np.full(contact.shape, np.inf)
    for side in range(2):
        for start, stop in runs(contact[:, side]):
            near = np.maximum(start - frames, frames - (stop - 1)).clip(min=0)
            away[:, side] = np.minimum(away[:, side], near)
    return min_jerk(1.0 - away / (_BLEND * fps))


def _within_reach(
    body: BodyModel,
    root: _Points,
    R: _Turns,
    ankles: Float[np.ndarray, "frames 2 3"],
    palms: Float[np.ndarray, "frames 2 3"],
    hold: Float[np.ndarray, "frames 2"],
) -> _Points:
    """Move the hips smoothly towards what the hands hold, then down to where the feet are reached."""
    rest = body.rest_joints.double().numpy()
    for _ in range(_ROUNDS):
        joints, move = joints_of(body, root, R), np.zeros_like(root)
        for side in range(2):
            shoulder, wrist = _SHOULDERS[side], _SHOULDERS[side] + 4
            length = _limb(rest, shoulder, shoulder + 2, wrist)
            goal = palms[:, side] - (joints[:, 22 + side] - joints[:, wrist])
            way = goal - joints[:, shoulder]
            far = np.linalg.norm(way, axis=1)
            excess = (far - _WITHIN * length).clip(min=0) * hold[:, side]
            move += 0.7 * (excess / far.clip(min=1e-6))[:, None] * way
        root = root + gaussian_filter1d(move, 3.0, axis=0, mode="nearest")
    return root - _drop(body, root, R, ankles)[:, None] * [0.0, 0.0, 1.0]


def _drop(
    body: BodyModel, root: _Points, R: _Turns, ankles: Float[np.ndarray, "frames 2 3"]
) -> Float[np.ndarray, " frames"]:
    """How much lower the hips must be for both legs to reach."""
    rest, need = body.rest_joints.double().numpy(), np.zeros(len(root))
    joints = joints_of(body, root, R)
    for side, hip in enumerate(_HIPS):
        way = joints[:, hip] - ankles[:, side]
        across = np.linalg.norm(way[:, :2], axis=1)
        high = np.sqrt(((_WITHIN * _leg(rest)) ** 2 - across**2).clip(min=0.0))
        need = np.maximum(need, way[:, 2] - high)
    # The largest need of the neighbourhood, then smoothed: never less than the need itself.
    near = maximum_filter1d(need, 13, mode="nearest")
    return gaussian_filter1d(near, 2.0, truncate=3.0, mode="nearest")


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
