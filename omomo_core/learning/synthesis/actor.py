"""The body re-solved to hold the prop: bend, twist, shoulders, arms, and the feet kept in place."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from omomo_core.body.kinematics import joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.runs import runs
from omomo_core.learning.synthesis.arms import SHOULDERS, with_arms, wrist_goals
from omomo_core.learning.synthesis.base_motion import BaseMotion
from omomo_core.learning.synthesis.bend import Torso, bent, manner
from omomo_core.learning.synthesis.directions import ahead_of, in_space
from omomo_core.learning.synthesis.footage import heading
from omomo_core.learning.synthesis.hands import Hands
from omomo_core.learning.synthesis.posture import Posture
from omomo_core.skeleton import joint

_STRAIGHT_LEG = 0.995
"""Of hip to ankle at full stretch; the pelvis comes down before a knee locks."""
_AMOUNTS = np.linspace(0.0, 1.2, 13)
_KNEES_BEND = ([0.3, 0.8], [1.0, 0.0])
"""Of what the person's squatting amounts to: for hands at these heights, metres."""
_HANGING, _ARMS_HANG = 1.03, ([0.65, 0.95], [1.0, 0.0])
"""Share of the straight arm that is reached with under a bent trunk, from which arms hang (the
shoulder girdle gives the rest): for hands at these heights, metres."""
_MOST_BEND = ([0.65, 0.9, 1.15], [1.2, 0.5, 0.2])
"""Nobody bends far for what is high: for hands at these heights, metres."""
_BEND_BACK = ([-0.15, 0.25], [0.15, 1.2])
"""Nor for what is behind: bending takes the shoulders away from it. For hands this far ahead of the
pelvis, metres."""
_FAR_HAND = 0.5
"""How much farther ahead than the other a hand may be for the shoulders to follow, metres; they turn by
a radian for a metre."""
_LEGS: tuple[tuple[LimbName, int], ...] = (
    ("left_leg", joint("left_ankle")),
    ("right_leg", joint("right_ankle")),
)


@dataclass(frozen=True)
class ActorMotion:
    """The finished motion of the body."""

    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    residual: Float[np.ndarray, "frames 2"]
    """How far each held palm is from its place, metres (0 where nothing is held)."""


@dataclass(frozen=True)
class _Pose:
    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]


def solve_actor(
    body: BodyModel, base_motion: BaseMotion, posture: Posture, hands: Hands
) -> ActorMotion:
    """Solve the whole body for one clip."""
    yaw = gaussian_filter1d(heading(base_motion.rotations), 4.0, mode="nearest")
    engaged = gaussian_filter1d(hands.pull.max(axis=1), 3.0, mode="nearest")
    torso = Torso(
        yaw=yaw,
        how=manner(posture.squat * np.interp(_lowest_palm(hands), *_KNEES_BEND)),
        lean=posture.lean * engaged + base_motion.sway[:, 3],
        twist=posture.twist * _twist(base_motion, hands, yaw) + base_motion.sway[:, 4],
    )
    base = _shifted(base_motion, posture, yaw, engaged)
    feet = joints_of(body, base_motion.root, base_motion.rotations)
    amount = _amount(body, base, feet, hands, torso, posture.comfort)
    pose = _Pose(*bent(body, base.root, base.rotations, amount, torso))
    pose = _settled(body, pose, feet)
    pose = replace(pose, rotations=with_arms(body, pose.root, pose.rotations, hands, yaw))
    pose = _legs(body, pose, feet)
    joints = joints_of(body, pose.root, pose.rotations)
    residual = np.linalg.norm(joints[:, 22:] - hands.palms, axis=-1) * hands.contact
    return ActorMotion(pose.root, pose.rotations, residual)


def _lowest_palm(hands: Hands) -> Float[np.ndarray, " frames"]:
    """Return the height of the lower hand in use, interpolated where none is."""
    held = hands.contact > 0
    lowest = np.where(held, hands.palms[..., 2], np.inf).min(axis=1)
    frames = np.flatnonzero(held.any(axis=1))
    return np.interp(np.arange(len(lowest)), frames, lowest[frames])


def _shifted(
    base_motion: BaseMotion,
    posture: Posture,
    yaw: Float[np.ndarray, " frames"],
    engaged: Float[np.ndarray, " frames"],
) -> _Pose:
    """Return the pelvis shifted ahead of the feet or behind them, and lowered."""
    ahead = in_space(ahead_of(yaw))
    shift = posture.shift * ahead - np.array([0.0, 0.0, posture.crouch])
    return _Pose(
        base_motion.root + base_motion.sway[:, :3] + engaged[:, None] * shift, base_motion.rotations
    )


def _settled(body: BodyModel, pose: _Pose, feet: Float[np.ndarray, "frames 24 3"]) -> _Pose:
    """Bring the pelvis down to where both legs reach their feet."""
    need = _too_high(body, joints_of(body, pose.root, pose.rotations), feet)
    drop = gaussian_filter1d(maximum_filter1d(need, 5, mode="nearest"), 2.0, mode="nearest")
    return replace(pose, root=pose.root - np.array([0.0, 0.0, 1.0]) * drop[:, None])


def _too_high(
    body: BodyModel, joints: Float[np.ndarray, "*b 24 3"], feet: Float[np.ndarray, "*#b 24 3"]
) -> Float[np.ndarray, "*b"]:
    """How far the pelvis must come down for both legs to reach their feet, metres."""
    rest = body.rest_joints.double().numpy()
    need = np.zeros(joints.shape[:-2])
    for hip, knee, ankle in ((joint(f"{s}_{n}") for n in ("hip", "knee", "ankle"))
                             for s in ("left", "right")):  # fmt: skip
        length = _STRAIGHT_LEG * float(
            np.linalg.norm(rest[knee] - rest[hip]) + np.linalg.norm(rest[ankle] - rest[knee])
        )
        apart = joints[..., hip, :] - feet[..., ankle, :]
        level = np.sqrt((length**2 - (apart[..., :2] ** 2).sum(-1)).clip(0.0))
        need = np.maximum(need, apart[..., 2] - level)
    return need


def _twist(
    base_motion: BaseMotion, hands: Hands, yaw: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, " frames"]:
    """Turn the chest toward the middle of the palms in use, and a shoulder after a hand that is far."""
    weight = hands.pull / np.maximum(hands.pull.sum(axis=1, keepdims=True), 1e-6)
    middle = (hands.palms * weight[..., None]).sum(axis=1) - base_motion.root
    ahead = middle[:, 0] * np.cos(yaw) + middle[:, 1] * np.sin(yaw)
    aside = middle[:, 1] * np.cos(yaw) - middle[:, 0] * np.sin(yaw)
    both = hands.pull.min(axis=1)
    angle = np.arctan2(aside, np.maximum(ahead, 0.15)).clip(-0.9, 0.9)
    apart = hands.palms[:, 0] - hands.palms[:, 1]
    left_is_farther = apart[:, 0] * np.cos(yaw) + apart[:, 1] * np.sin(yaw)
    angle = angle - left_is_farther.clip(-_FAR_HAND, _FAR_HAND)
    return gaussian_filter1d(angle * both, 4.0, mode="nearest")


def _amount(
    body: BodyModel,
    base: _Pose,
    feet: Float[np.ndarray, "frames 24 3"],
    hands: Hands,
    torso: Torso,
    comfort: float,
) -> Float[np.ndarray, " frames"]:
    """The least bending that brings the shoulders near enough, smooth in time."""
    goals, lengths = wrist_goals(body, hands)
    held = np.flatnonzero(hands.contact.any(axis=1))
    root, rotations = bent(
        body, base.root[held, None], base.rotations[held, None], _AMOUNTS, torso.rows(held)
    )
    joints = joints_of(body, root, rotations)
    drop = _too_high(body, joints, feet[held, None])[..., None, None]
    shoulders = joints[..., SHOULDERS, :] - np.array([0.0, 0.0, 1.0]) * drop
    distance = np.linalg.norm(goals[held, None] - shoulders, axis=-1) / lengths
    need = np.where(hands.contact[held, None] > 0, distance, 0.0).max(axis=-1)
    low = _lowest_palm(hands)[held]
    hang = np.interp(low, *_ARMS_HANG) * torso.how.hang[held]
    share = comfort + hang * (max(comfort, _HANGING) - comfort)
    enough = need <= share[:, None]
    first = np.where(enough.any(axis=1), enough.argmax(axis=1), need.argmin(axis=1))
    # Between two samples the reach is nearly linear in the amount.
    rows = np.arange(len(held))
    before = (first - 1).clip(0)
    gain = need[rows, before] - need[rows, first]
    part = ((need[rows, before] - share) / np.maximum(gain, 1e-6)).clip(0.0, 1.0)
    least = _AMOUNTS[before] + part * (_AMOUNTS[first] - _AMOUNTS[before])
    least = np.where(first == 0, 0.0, least)
    most = np.interp(low, *_MOST_BEND)
    to_goal = goals[held] - base.root[held, None]
    ahead = (to_goal * in_space(ahead_of(torso.yaw[held]))[:, None]).sum(axis=-1)
    last = np.where(hands.contact[held] > 0, ahead, np.inf).min(axis=1)
    least = np.minimum(least, np.minimum(most, np.interp(last, *_BEND_BACK)))
    smooth = gaussian_filter1d(maximum_filter1d(least, 7, mode="nearest"), 3.0, mode="nearest")
    amount = np.zeros(len(base.root))
    amount[held] = smooth
    return _ramped(amount, torso.how.drop, np.asarray(hands.contact.any(axis=1)))


def _ramped(
    amount: Float[np.ndarray, " frames"],
    drop: Float[np.ndarray, " frames"],
    held: Bool[np.ndarray, " frames"],
) -> Float[np.ndarray, " frames"]:
    """Going down before hands arrive, coming up after they leave; deep bends take longer."""
    t = np.arange(len(amount))
    out = amount.copy()
    for first, last in runs(held):
        for edge, ahead in ((first, first - t), (last - 1, t - last + 1)):
            length = 9.0 + 14.0 * amount[edge] + 16.0 * amount[edge] ** 2 * drop[edge]
            ramp = amount[edge] * min_jerk(1.0 - ahead / length)
            out = np.where((ahead > 0) & ~held, np.maximum(out, ramp), out)
    return gaussian_filter1d(out, 2.0, mode="nearest")


def _legs(body: BodyModel, pose: _Pose, feet: Float[np.ndarray, "frames 24 3"]) -> _Pose:
    """Feet stay where they were in the base motion."""
    root, turned = torch.as_tensor(pose.root), torch.as_tensor(pose.rotations)
    for leg, ankle in _LEGS:
        turned, _ = reach(body, root, turned, leg, torch.as_tensor(feet[:, ankle]))
    return replace(pose, rotations=turned.numpy())
