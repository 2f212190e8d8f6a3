"""The body re-solved to hold the prop: bent trunk, shoulders, arms, feet."""

from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import min_jerk, runs
from omomo_core.learning.synthesis.base_motion import (
    BaseMotion,
    about_z,
    ahead_of,
    heading,
    in_space,
    left_of,
)
from omomo_core.learning.synthesis.holds import Posture
from omomo_core.learning.synthesis.palms_on_prop import Hands
from omomo_core.skeleton import BODY_JOINTS, PALM_JOINTS, joint

_WRISTS = (joint("left_wrist"), joint("right_wrist"))
SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
_ELBOWS = (joint("left_elbow"), joint("right_elbow"))
_COLLARS = (joint("left_collar"), joint("right_collar"))
_SPINE3 = joint("spine3")
_ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")


def wrist_goals(
    body: BodyModel, hands: Hands
) -> tuple[Float[np.ndarray, "frames 2 3"], Float[np.ndarray, " 2"]]:
    """Return the wrists' goals, and the lengths of the straight arms up to them."""
    rest = body.rest_joints.double().numpy()
    palm = np.stack([rest[p] - rest[w] for p, w in zip(PALM_JOINTS, _WRISTS, strict=True)])
    goals = hands.palms - np.einsum("thij,hj->thi", hands.R_world_wrist, palm)
    lengths = [
        float(np.linalg.norm(rest[e] - rest[s]) + np.linalg.norm(rest[w] - rest[e]))
        for s, e, w in zip(SHOULDERS, _ELBOWS, _WRISTS, strict=True)
    ]
    return goals, np.array(lengths)


def with_arms(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    hands: Hands,
    yaw: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Rotations with the hands on their way: to their places as far as they are pulled there.

    Args:
        body: whose arms.
        root: pelvis, world, metres.
        rotations: global R_world_joint.
        hands: places of the palms, and how much they pull.
        yaw: heading of the body, radians.
    """
    free = joints_of(body, root, rotations)[:, 22:]
    s = hands.pull[..., None]
    detour = (4.0 * s * (1.0 - s)) * (hands.contact[..., None] == 0) * hands.outward
    goals = torch.as_tensor(free + s * (hands.palms - free) + detour)
    rotations = rotations.copy()
    for h, w in enumerate(_WRISTS):
        rotations[:, w] = _blend(rotations[:, w], hands.R_world_wrist[:, h], hands.pull[:, h])
    rotations = _raise_collars(body, root, rotations, hands)
    joints = joints_of(body, root, rotations)
    for h, (arm, collar) in enumerate(zip(_ARMS, _COLLARS, strict=True)):
        pole = _elbow_pole(yaw, goals[:, h].numpy() - joints[:, SHOULDERS[h]], 1 - 2 * h)
        # Solved from straight arms, such that the elbow is a hinge whatever the mocap arm did.
        straight = rotations.copy()
        straight[:, [SHOULDERS[h], _ELBOWS[h]]] = rotations[:, collar, None]
        solved, _ = reach(
            body, torch.as_tensor(root), torch.as_tensor(straight), arm, goals[:, h],
            torch.as_tensor(pole),
        )  # fmt: skip
        weight = min_jerk(hands.pull[:, h] / 0.75)
        for j in (SHOULDERS[h], _ELBOWS[h]):
            rotations[:, j] = _blend(rotations[:, j], solved[:, j].numpy(), weight)
    return rotations


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
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    hands: Hands,
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Shoulder girdle: up when the hand is high, forward when it is far ahead."""
    goals, lengths = wrist_goals(body, hands)
    joints = joints_of(body, root, rotations)
    chest = rotations[:, _SPINE3].copy()
    rotations = rotations.copy()
    for h, collar in enumerate(_COLLARS):
        to_goal = goals[:, h] - joints[:, SHOULDERS[h]]
        local = np.einsum("tji,tj->ti", chest, to_goal) / lengths[h]
        up = 0.45 * (local[:, 1] + 0.35).clip(0.0, 1.0)
        forward = 0.35 * (local[:, 2] - 0.25).clip(0.0, 0.8)
        side = 1.0 - 2.0 * h
        rotvec = np.stack([np.zeros_like(up), -side * forward, side * up], axis=-1)
        rotvec *= hands.pull[:, h, None]
        step = roma.rotvec_to_rotmat(torch.as_tensor(np.einsum("tij,tj->ti", chest, rotvec)))
        rotations[:, collar] = step.numpy() @ rotations[:, collar]
    return rotations


_PITCH_SHARE = {
    "pelvis": 0.6, "spine1": 0.7, "spine2": 0.82, "spine3": 1.0, "neck": 0.8, "head": 0.6,
    "left_collar": 1.0, "right_collar": 1.0,
}  # fmt: skip
_TWIST_SHARE = {
    "pelvis": 0.1, "spine1": 0.25, "spine2": 0.42, "spine3": 0.6, "neck": 0.6, "head": 0.7,
    "left_collar": 0.6, "right_collar": 0.6,
}  # fmt: skip
_ARM_PITCH, _ARM_TWIST = 0.4, 0.6
"""Free arms hang: they follow the trunk only in part."""
_LOWEST_DROP = 0.6
"""Lowest drop of the hips: thighs lie on the calves, metres."""
_ARM_JOINTS = tuple(
    f"{side}_{p}" for side in ("left", "right") for p in ("shoulder", "elbow", "wrist")
)


@dataclass(frozen=True)
class BendStyle:
    """What full bending (amount 1) means for one person; from stooping to sitting on the heels."""

    pitch: Float[np.ndarray, "*b"]
    drop: Float[np.ndarray, "*b"]
    """The hips go down by this, metres."""
    back: Float[np.ndarray, "*b"]
    """The hips go back by this, metres, so that the feet stay under the weight."""
    hang: Float[np.ndarray, "*b"]
    """How much arms hang straight down: 1 for those who stoop, 0 for those who squat."""

    def rows(self, frames: Int[np.ndarray, " n"]) -> "BendStyle":
        """Some frames, with room for another axis."""
        parts = (self.pitch, self.drop, self.back, self.hang)
        return BendStyle(*(part[frames, None] for part in parts))


def manner(squat: Float[np.ndarray, " frames"]) -> BendStyle:
    """Stooping (0) bends the back over nearly straight knees, squatting (1) the knees (the styles of
    lifting of von Arx et al. 2021), and some sit down on their heels (2)."""

    def style(stoop: float, squatting: float, sitting: float) -> Float[np.ndarray, " frames"]:
        return np.interp(squat, [0.0, 1.0, 2.0], [stoop, squatting, sitting])

    return BendStyle(
        pitch=style(2.1, 0.9, 0.6),
        drop=style(0.02, 0.47, 0.6),
        back=style(0.2, 0.13, 0.11),
        hang=style(1.0, 0.0, 0.0),
    )


def _share(table: dict[str, float], arms: float) -> Float[np.ndarray, " 22"]:
    arm_table = dict.fromkeys(_ARM_JOINTS, arms)
    return np.array([(table | arm_table).get(name, 0.0) for name in BODY_JOINTS])


_PITCH, _TWIST = _share(_PITCH_SHARE, _ARM_PITCH), _share(_TWIST_SHARE, _ARM_TWIST)


@dataclass(frozen=True)
class Torso:
    """What the trunk does besides going down."""

    yaw: Float[np.ndarray, "*b"]
    """Heading that "forward" means."""
    how: BendStyle
    lean: Float[np.ndarray, "*b"]
    """Forward pitch of the trunk, radians."""
    twist: Float[np.ndarray, "*b"]
    """Twist of the shoulders against the feet, radians, positive to the left."""

    def rows(self, frames: Int[np.ndarray, " n"]) -> "Torso":
        """Some frames, with room for another axis."""
        return Torso(
            self.yaw[frames, None],
            self.how.rows(frames),
            self.lean[frames, None],
            self.twist[frames, None],
        )


def bent(
    body: BodyModel,
    root: Float[np.ndarray, "*#c 3"],
    rotations: Float[np.ndarray, "*#c 22 3 3"],
    amount: Float[np.ndarray, "*#c"],
    torso: Torso,
) -> tuple[Float[np.ndarray, "*c 3"], Float[np.ndarray, "*c 22 3 3"]]:
    """Bend a base motion down, lean it forward and twist it. All batch axes are broadcast.

    Args:
        body: whose hips the pelvis turns about.
        root: pelvis, world, metres.
        rotations: global R_world_joint.
        amount: 0 upright, 1 fully down as `torso.how` says.
        torso: the manner of bending, lean and twist.

    Returns:
        Root and rotations; the legs keep their rotations and must be solved to their feet.
    """
    how, yaw = torso.how, torso.yaw
    pitch = amount * how.pitch + torso.lean
    turn = about_z(torso.twist[..., None] * _TWIST) @ _about_left(yaw, pitch[..., None] * _PITCH)
    turned = turn @ rotations
    rest = body.rest_joints.double().numpy()
    to_hips = (rest[joint("left_hip")] + rest[joint("right_hip")]) / 2 - rest[0]
    hips = root + rotations[..., 0, :, :] @ to_hips
    ahead = in_space(ahead_of(yaw))
    # Going down, hips and back lead and the knees follow (Burgess-Limerick et al. 1995).
    down = np.array([0.0, 0.0, 1.0]) * np.minimum(amount**2 * how.drop, _LOWEST_DROP)[..., None]
    hips = hips - (amount * how.back)[..., None] * ahead - down
    return hips - turned[..., 0, :, :] @ to_hips, turned


def _about_left(
    yaw: Float[np.ndarray, "*#b"], angle: Float[np.ndarray, "*#b n"]
) -> Float[np.ndarray, "*b n 3 3"]:
    """Pitch forward about the horizontal axis to the left of the heading."""
    heading = about_z(yaw)[..., None, :, :]
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    pitch = np.stack([c, o, s, o, o + 1.0, o, -s, o, c], axis=-1).reshape(*angle.shape, 3, 3)
    return heading @ pitch @ np.swapaxes(heading, -1, -2)


_STRAIGHT_LEG = 0.995
"""Part of hip to ankle at full stretch; the pelvis comes down before a knee locks."""
_AMOUNTS = np.linspace(0.0, 1.2, 13)
_KNEES_BEND = ([0.3, 0.8], [1.0, 0.0])
"""Heights of the hands (metres), and the part of the person's squatting that belongs to each."""
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
