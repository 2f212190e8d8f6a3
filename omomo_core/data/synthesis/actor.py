"""The body re-solved to hold the prop: bend, twist, shoulders, arms, and the feet kept in place."""

from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.data.synthesis.bend import Torso, bent, manner
from omomo_core.data.synthesis.directions import ahead_of, in_space, left_of
from omomo_core.data.synthesis.footage import heading
from omomo_core.data.synthesis.hands import Hands
from omomo_core.data.synthesis.posture import Posture
from omomo_core.data.synthesis.stage import Stage
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.runs import runs
from omomo_core.skeleton import PALM_JOINTS, joint

_STRAIGHT_LEG = 0.995
"""Of hip to ankle at full stretch; the pelvis comes down before a knee locks."""
_AMOUNTS = np.linspace(0.0, 1.2, 13)
_KNEES_BEND = ([0.45, 0.9], [1.0, 0.0])
"""Of what the person's squatting amounts to: for hands at these heights, metres."""
_MOST_BEND = ([0.65, 0.9, 1.15], [1.2, 0.5, 0.2])
"""Nobody bends far for what is high: for hands at these heights, metres."""
_BEND_BACK = ([-0.15, 0.25], [0.15, 1.2])
"""Nor for what is behind: bending takes the shoulders away from it. For hands this far ahead of the
pelvis, metres."""
_WRISTS = (joint("left_wrist"), joint("right_wrist"))
_SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
_ELBOWS = (joint("left_elbow"), joint("right_elbow"))
_COLLARS = (joint("left_collar"), joint("right_collar"))
_SPINE3 = joint("spine3")
_ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")
_LEGS: tuple[tuple[LimbName, int], ...] = (
    ("left_leg", joint("left_ankle")),
    ("right_leg", joint("right_ankle")),
)


@dataclass(frozen=True)
class Performance:
    """The finished motion of the body."""

    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    residual: Float[np.ndarray, "frames 2"]
    """How far each held palm is from its place, metres (0 where nothing is held)."""


@dataclass(frozen=True)
class _Pose:
    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]


def perform(body: BodyModel, stage: Stage, posture: Posture, hands: Hands) -> Performance:
    """Solve the whole body for one clip."""
    yaw = gaussian_filter1d(heading(stage.rotations), 4.0, mode="nearest")
    engaged = gaussian_filter1d(hands.pull.max(axis=1), 3.0, mode="nearest")
    torso = Torso(
        yaw=yaw,
        how=manner(posture.squat * np.interp(_lowest_palm(hands), *_KNEES_BEND)),
        lean=posture.lean * engaged + stage.sway[:, 3],
        twist=posture.twist * _twist(stage, hands, yaw) + stage.sway[:, 4],
    )
    base = _shifted(stage, posture, yaw, engaged)
    amount = _amount(body, base, hands, torso, posture.comfort)
    pose = _Pose(*bent(body, base.root, base.rotations, amount, torso))
    feet = joints_of(body, stage.root, stage.rotations)
    pose = _settled(body, pose, feet)
    pose = _arms(body, pose, hands, yaw)
    pose = _legs(body, pose, feet)
    joints = joints_of(body, pose.root, pose.rotations)
    residual = np.linalg.norm(joints[:, 22:] - hands.palms, axis=-1) * hands.contact
    return Performance(pose.root, pose.rotations, residual)


def _lowest_palm(hands: Hands) -> Float[np.ndarray, " frames"]:
    """Height of the lower hand at work, as it was last and will be next where there is none."""
    held = hands.contact > 0
    lowest = np.where(held, hands.palms[..., 2], np.inf).min(axis=1)
    frames = np.flatnonzero(held.any(axis=1))
    return np.interp(np.arange(len(lowest)), frames, lowest[frames])


def _shifted(
    stage: Stage,
    posture: Posture,
    yaw: Float[np.ndarray, " frames"],
    engaged: Float[np.ndarray, " frames"],
) -> _Pose:
    """The pelvis of somebody at work: ahead of the feet or behind them, and lower."""
    ahead = in_space(ahead_of(yaw))
    shift = posture.shift * ahead - np.array([0.0, 0.0, posture.crouch])
    return _Pose(stage.root + stage.sway[:, :3] + engaged[:, None] * shift, stage.rotations)


def _settled(body: BodyModel, pose: _Pose, feet: Float[np.ndarray, "frames 24 3"]) -> _Pose:
    """Bring the pelvis down to where both legs reach their feet."""
    rest = body.rest_joints.double().numpy()
    joints = joints_of(body, pose.root, pose.rotations)
    need = np.zeros(len(pose.root))
    for hip, knee, ankle in ((joint(f"{s}_{n}") for n in ("hip", "knee", "ankle"))
                             for s in ("left", "right")):  # fmt: skip
        length = _STRAIGHT_LEG * float(
            np.linalg.norm(rest[knee] - rest[hip]) + np.linalg.norm(rest[ankle] - rest[knee])
        )
        apart = joints[:, hip] - feet[:, ankle]
        level = np.sqrt((length**2 - (apart[:, :2] ** 2).sum(-1)).clip(0.0))
        need = np.maximum(need, apart[:, 2] - level)
    drop = gaussian_filter1d(maximum_filter1d(need, 5, mode="nearest"), 2.0, mode="nearest")
    return replace(pose, root=pose.root - np.array([0.0, 0.0, 1.0]) * drop[:, None])


def _wrist_goals(
    body: BodyModel, hands: Hands
) -> tuple[Float[np.ndarray, "frames 2 3"], Float[np.ndarray, " 2"]]:
    """Where the wrists must be, and how long the straight arms are up to them."""
    rest = body.rest_joints.double().numpy()
    palm = np.stack([rest[p] - rest[w] for p, w in zip(PALM_JOINTS, _WRISTS, strict=True)])
    goals = hands.palms - np.einsum("thij,hj->thi", hands.R_world_wrist, palm)
    lengths = [
        float(np.linalg.norm(rest[e] - rest[s]) + np.linalg.norm(rest[w] - rest[e]))
        for s, e, w in zip(_SHOULDERS, _ELBOWS, _WRISTS, strict=True)
    ]
    return goals, np.array(lengths)


def _twist(
    stage: Stage, hands: Hands, yaw: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, " frames"]:
    """Turn the chest toward the middle of the palms in use."""
    weight = hands.pull / np.maximum(hands.pull.sum(axis=1, keepdims=True), 1e-6)
    middle = (hands.palms * weight[..., None]).sum(axis=1) - stage.root
    ahead = middle[:, 0] * np.cos(yaw) + middle[:, 1] * np.sin(yaw)
    aside = middle[:, 1] * np.cos(yaw) - middle[:, 0] * np.sin(yaw)
    both = hands.pull.min(axis=1)
    angle = np.arctan2(aside, np.maximum(ahead, 0.15)).clip(-0.9, 0.9)
    return gaussian_filter1d(angle * both, 4.0, mode="nearest")


def _amount(
    body: BodyModel, base: _Pose, hands: Hands, torso: Torso, comfort: float
) -> Float[np.ndarray, " frames"]:
    """The least bending that brings the shoulders near enough, smooth in time."""
    goals, lengths = _wrist_goals(body, hands)
    held = np.flatnonzero(hands.contact.any(axis=1))
    root, rotations = bent(
        body, base.root[held, None], base.rotations[held, None], _AMOUNTS, torso.rows(held)
    )
    shoulders = joints_of(body, root, rotations)[..., _SHOULDERS, :]
    distance = np.linalg.norm(goals[held, None] - shoulders, axis=-1) / lengths
    need = np.where(hands.contact[held, None] > 0, distance, 0.0).max(axis=-1)
    enough = need <= comfort
    first = np.where(enough.any(axis=1), enough.argmax(axis=1), need.argmin(axis=1))
    # Between two samples the reach is nearly linear in the amount.
    rows = np.arange(len(held))
    before = (first - 1).clip(0)
    gain = need[rows, before] - need[rows, first]
    part = ((need[rows, before] - comfort) / np.maximum(gain, 1e-6)).clip(0.0, 1.0)
    least = _AMOUNTS[before] + part * (_AMOUNTS[first] - _AMOUNTS[before])
    least = np.where(first == 0, 0.0, least)
    most = np.interp(_lowest_palm(hands)[held], *_MOST_BEND)
    to_goal = goals[held] - base.root[held, None]
    ahead = (to_goal * in_space(ahead_of(torso.yaw[held]))[:, None]).sum(axis=-1)
    last = np.where(hands.contact[held] > 0, ahead, np.inf).min(axis=1)
    least = np.minimum(least, np.minimum(most, np.interp(last, *_BEND_BACK)))
    smooth = gaussian_filter1d(maximum_filter1d(least, 7, mode="nearest"), 3.0, mode="nearest")
    amount = np.zeros(len(base.root))
    amount[held] = smooth
    return _ramped(amount, np.asarray(hands.contact.any(axis=1)))


def _ramped(
    amount: Float[np.ndarray, " frames"], held: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, " frames"]:
    """Going down before hands arrive, coming up after they leave; deep bends take longer."""
    t = np.arange(len(amount))
    out = amount.copy()
    for first, last in runs(held):
        for edge, ahead in ((first, first - t), (last - 1, t - last + 1)):
            length = 12.0 + 26.0 * amount[edge]
            ramp = amount[edge] * min_jerk(1.0 - ahead / length)
            out = np.where((ahead > 0) & ~held, np.maximum(out, ramp), out)
    return gaussian_filter1d(out, 2.0, mode="nearest")


def _arms(body: BodyModel, pose: _Pose, hands: Hands, yaw: Float[np.ndarray, " frames"]) -> _Pose:
    free = joints_of(body, pose.root, pose.rotations)[:, 22:]
    s = hands.pull[..., None]
    detour = (4.0 * s * (1.0 - s)) * (hands.contact[..., None] == 0) * hands.outward
    goals = torch.as_tensor(free + s * (hands.palms - free) + detour)
    rotations = pose.rotations.copy()
    for h, w in enumerate(_WRISTS):
        rotations[:, w] = _blend(rotations[:, w], hands.R_world_wrist[:, h], hands.pull[:, h])
    rotations = _raise_collars(body, replace(pose, rotations=rotations), hands)
    joints = joints_of(body, pose.root, rotations)
    for h, (arm, collar) in enumerate(zip(_ARMS, _COLLARS, strict=True)):
        pole = _elbow_pole(yaw, goals[:, h].numpy() - joints[:, _SHOULDERS[h]], 1 - 2 * h)
        # Solved from straight arms, such that the elbow is a hinge whatever the mocap arm did.
        straight = rotations.copy()
        straight[:, [_SHOULDERS[h], _ELBOWS[h]]] = rotations[:, collar, None]
        solved, _ = reach(
            body, torch.as_tensor(pose.root), torch.as_tensor(straight), arm, goals[:, h],
            torch.as_tensor(pole),
        )  # fmt: skip
        weight = min_jerk(hands.pull[:, h] / 0.75)
        for j in (_SHOULDERS[h], _ELBOWS[h]):
            rotations[:, j] = _blend(rotations[:, j], solved[:, j].numpy(), weight)
    return replace(pose, rotations=rotations)


def _blend(
    a: Float[np.ndarray, "frames 3 3"],
    b: Float[np.ndarray, "frames 3 3"],
    weight: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 3 3"]:
    """From a to b by weight, going the same way round in neighbouring frames."""
    first, second = (_steady(Rotation.from_matrix(R).as_quat()) for R in (a, b))
    # Which way round only matters between two frames that are all b.
    splits = [(i + j) // 2 for i, j in runs(weight >= 1.0)]
    for i, j in zip([0, *splits], [*splits, len(weight)], strict=True):
        part = slice(i, j)
        apart = ((first[part] * second[part]).sum(-1) * weight[part] * (1 - weight[part])).sum()
        second[part] *= 1.0 if apart >= 0 else -1.0
    angle = np.arccos((first * second).sum(-1).clip(-0.999, 0.999999))
    mixed = np.sin((1 - weight) * angle)[:, None] * first + np.sin(weight * angle)[:, None] * second
    return Rotation.from_quat(mixed).as_matrix()


def _steady(quaternions: Float[np.ndarray, "frames 4"]) -> Float[np.ndarray, "frames 4"]:
    """Signs chosen such that neighbours are alike."""
    dots = (quaternions[1:] * quaternions[:-1]).sum(-1)
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0))
    return quaternions * np.concatenate([[1.0], signs])[:, None]


def _elbow_pole(
    yaw: Float[np.ndarray, " frames"], to_goal: Float[np.ndarray, "frames 3"], side: int
) -> Float[np.ndarray, "frames 3"]:
    """Elbows point back under a hanging arm, down under one stretched ahead, always a bit outward."""
    ahead, left = in_space(ahead_of(yaw)), in_space(left_of(yaw))
    along = to_goal / np.linalg.norm(to_goal, axis=-1, keepdims=True)
    down = np.array([0.0, 0.0, -1.0])
    return np.cross(left, along) + 0.35 * side * left + 0.25 * down - 0.15 * ahead


def _raise_collars(
    body: BodyModel, pose: _Pose, hands: Hands
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Shoulder girdle: up when the hand is high, forward when it is far ahead."""
    goals, lengths = _wrist_goals(body, hands)
    joints = joints_of(body, pose.root, pose.rotations)
    chest = pose.rotations[:, _SPINE3]
    rotations = pose.rotations.copy()
    for h, collar in enumerate(_COLLARS):
        to_goal = goals[:, h] - joints[:, _SHOULDERS[h]]
        local = np.einsum("tji,tj->ti", chest, to_goal) / lengths[h]
        up = 0.45 * (local[:, 1] + 0.35).clip(0.0, 1.0)
        forward = 0.35 * (local[:, 2] - 0.25).clip(0.0, 0.8)
        side = 1.0 - 2.0 * h
        rotvec = np.stack([np.zeros_like(up), -side * forward, side * up], axis=-1)
        rotvec *= hands.pull[:, h, None]
        step = roma.rotvec_to_rotmat(torch.as_tensor(np.einsum("tij,tj->ti", chest, rotvec)))
        rotations[:, collar] = step.numpy() @ rotations[:, collar]
    return rotations


def _legs(body: BodyModel, pose: _Pose, feet: Float[np.ndarray, "frames 24 3"]) -> _Pose:
    """Feet stay where they were in the base motion."""
    root, turned = torch.as_tensor(pose.root), torch.as_tensor(pose.rotations)
    for leg, ankle in _LEGS:
        turned, _ = reach(body, root, turned, leg, torch.as_tensor(feet[:, ankle]))
    return replace(pose, rotations=turned.numpy())
