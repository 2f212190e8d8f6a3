"""Arms that hold: shoulder girdle raised, elbows where they belong, hands on their way and in place."""

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.runs import runs
from omomo_core.learning.synthesis.directions import ahead_of, in_space, left_of
from omomo_core.learning.synthesis.hands import Hands
from omomo_core.skeleton import PALM_JOINTS, joint

_WRISTS = (joint("left_wrist"), joint("right_wrist"))
SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
_ELBOWS = (joint("left_elbow"), joint("right_elbow"))
_COLLARS = (joint("left_collar"), joint("right_collar"))
_SPINE3 = joint("spine3")
_ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")


def wrist_goals(
    body: BodyModel, hands: Hands
) -> tuple[Float[np.ndarray, "frames 2 3"], Float[np.ndarray, " 2"]]:
    """Where the wrists must be, and how long the straight arms are up to them."""
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
