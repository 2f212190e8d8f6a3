"""Making a sampled body keep its promises: planted feet stay put, holding palms stay on the object."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.generation.steps import add_steps
from omomo_core.skeleton import joint

PLANTED = 0.5
SHORTEST_STEP = 4
"""Frames: shorter plants are not locked."""
STRETCH = 0.97
"""Share of a straight arm's length that the pelvis is moved to stay within."""
LEG_STRETCH = 0.995
LOWEST = 0.25
"""Metres that the pelvis is lowered at most for the legs to reach the floor."""
FARTHEST = 0.25
"""Metres that the pelvis is moved at most: beyond that the sample is wrong and must say so."""
ARMS = ("left_arm", "right_arm")
LEGS = ("left_leg", "right_leg")
ANKLES, TOES = (joint("left_ankle"), joint("right_ankle")), (10, 11)
SHOULDERS, WRISTS = (16, 17), (20, 21)


@dataclass(frozen=True)
class Solved:
    """A body that keeps its promises, or says where it could not."""

    root: Float[Tensor, "frames 3"]
    rotations: Float[Tensor, "frames 22 3 3"]
    standing: Bool[np.ndarray, "frames 2"]
    """Left, right foot is planted."""
    miss: Float[Tensor, "frames 2"]
    """How far each palm is from its place where it should hold, metres; 0 where it need not."""


def solve_body(
    body: BodyModel,
    root: Float[Tensor, "frames 3"],
    rotations: Float[Tensor, "frames 22 3 3"],
    foot_contact: Float[Tensor, "frames 4"],
    palms: Float[Tensor, "frames 2 3"],
    hold: Float[Tensor, "frames 2"],
) -> Solved:
    """Solve one sample.

    Args:
        body: whose bones.
        root: sampled pelvis, world, metres.
        rotations: sampled global rotations.
        foot_contact: probability that left ankle, right ankle, left toe, right toe is planted.
        palms: where the palms should be, world, metres.
        hold: how strongly, in [0, 1].
    """
    feet, standing = _foot_targets(body, root, rotations, foot_contact)
    sampled = root
    for _ in range(3):
        move = root + _towards(body, root, rotations, palms, hold) - sampled
        root = sampled + move * (FARTHEST / move.norm(dim=-1, keepdim=True).clamp(min=FARTHEST))
    root = root - _up(_drop(body, root, rotations, feet, standing))
    for side, leg in enumerate(LEGS):
        rotations, _ = reach(body, root, rotations, leg, feet[:, side])
    for side, arm in enumerate(ARMS):
        rotations, _ = reach(
            body, root, rotations, arm, palms[:, side], weight=hold[:, side].contiguous()
        )
    reached = forward_kinematics(body, root, rotations)[:, 22:]
    miss = (reached - palms).norm(dim=-1)
    return Solved(root, rotations, standing, torch.where(hold > 0.99, miss, torch.zeros_like(miss)))


def _towards(
    body: BodyModel, root: Tensor, rotations: Tensor, palms: Tensor, hold: Tensor
) -> Float[Tensor, "frames 3"]:
    """A smooth move of the pelvis that brings palms which are out of reach within it."""
    joints = forward_kinematics(body, root, rotations)
    rest = body.rest_joints
    move = torch.zeros_like(root)
    for side in range(2):
        shoulder, elbow, wrist = SHOULDERS[side], SHOULDERS[side] + 2, WRISTS[side]
        length = (rest[elbow] - rest[shoulder]).norm() + (rest[wrist] - rest[elbow]).norm()
        target = palms[:, side] - (joints[:, 22 + side] - joints[:, wrist])
        way = target - joints[:, shoulder]
        distance = way.norm(dim=-1, keepdim=True).clamp(min=1e-6)
        excess = (distance - STRETCH * length).clamp(min=0) * hold[:, side, None]
        move = move + 0.5 * excess * way / distance
    if float(move.abs().max()) == 0:
        return move
    return torch.from_numpy(gaussian_filter1d(move.numpy(), 4.0, axis=0, mode="nearest"))


def _drop(
    body: BodyModel,
    root: Tensor,
    rotations: Tensor,
    feet: Float[Tensor, "frames 2 3"],
    standing: Bool[np.ndarray, "frames 2"],
) -> Float[Tensor, " frames"]:
    """How much lower the pelvis must be for the legs to reach the feet that stand."""
    joints = forward_kinematics(body, root, rotations)
    rest, drop = body.rest_joints, torch.zeros(len(root))
    for side, (hip, knee, ankle) in enumerate(((1, 4, 7), (2, 5, 8))):
        length = (rest[knee] - rest[hip]).norm() + (rest[ankle] - rest[knee]).norm()
        way = joints[:, hip] - feet[:, side]
        across = way[:, :2].norm(dim=-1)
        height = ((LEG_STRETCH * length) ** 2 - across**2).clamp(min=0.04).sqrt()
        need = (way[:, 2] - height).clamp(0, LOWEST) * torch.from_numpy(standing[:, side])
        drop = torch.maximum(drop, need)
    # The largest need of the neighbourhood, then smoothed: never less than the need itself.
    spread = maximum_filter1d(drop.numpy(), 7, mode="nearest")
    return torch.from_numpy(gaussian_filter1d(spread, 2.0, mode="nearest"))


def _foot_targets(
    body: BodyModel, root: Tensor, rotations: Tensor, foot_contact: Tensor
) -> tuple[Float[Tensor, "frames 2 3"], Bool[np.ndarray, "frames 2"]]:
    """Ankles, still while planted and never with a toe or heel below the floor."""
    joints = forward_kinematics(body, root, rotations)
    sole = float(body.vertices[:, 1].min())
    heel, toe_down = (foot_contact[:, k : k + 2].numpy() > PLANTED for k in (0, 2))
    ankles = joints[:, ANKLES].numpy().astype(np.float64)
    ankles, standing = add_steps(ankles, heel | toe_down)
    to_toe = (joints[:, TOES] - joints[:, ANKLES]).numpy()
    targets: list[Tensor] = []
    for side in range(2):
        rolling = toe_down[:, side] & ~heel[:, side]
        still = ankles[:, side] + _corrections(
            ankles[:, side], to_toe[:, side], standing[:, side], rolling
        )
        locked = torch.from_numpy(still.astype(np.float32))
        toe = locked + torch.from_numpy(to_toe[:, side])
        for point, name in ((locked, ANKLES[side]), (toe, TOES[side])):
            height = float(body.rest_joints[name, 1]) - sole
            locked = locked + _up((height - point[:, 2]).clamp(min=0))
        targets.append(locked)
    return torch.stack(targets, dim=1), standing


def _up(height: Float[Tensor, " frames"]) -> Float[Tensor, "frames 3"]:
    zero = torch.zeros_like(height)
    return torch.stack([zero, zero, height], dim=-1)


def _corrections(
    ankle: Float[np.ndarray, "frames 3"],
    to_toe: Float[np.ndarray, "frames 3"],
    down: Bool[np.ndarray, " frames"],
    rolling: Bool[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 3"]:
    """What to add to an ankle so that its foot stands still in each plant; linear in between.

    Where only the toe is down (`rolling`) the foot turns about it and the ankle rises.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], down, [False]]).astype(int)))
    plants = [np.arange(a, b) for a, b in edges.reshape(-1, 2) if b - a >= SHORTEST_STEP]
    if not plants:
        return np.zeros_like(ankle)
    needed: list[Float[np.ndarray, "frames 3"]] = []
    for plant in plants:
        flat = plant[~rolling[plant]]
        toe = ankle[plant] + to_toe[plant]
        if len(flat):
            place = np.median(ankle[flat], axis=0)
            ball = place + np.median(to_toe[flat], axis=0)
        else:
            place = ball = np.median(toe, axis=0)
        needed.append(np.where(rolling[plant, None], ball - toe, place - ankle[plant]))
    frames, moves = np.concatenate(plants), np.concatenate(needed)
    return np.stack([np.interp(np.arange(len(ankle)), frames, m) for m in moves.T], axis=1)
