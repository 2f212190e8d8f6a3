"""Put a motion on the floor: level of what carries it, foot contacts, planted feet held still."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter1d

from omomo_core.body.kinematics import ANKLES, TOES, forward_kinematics, sole_points
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

_LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")
_SUPPORT_SPEED = 0.4
"""Metres per second below which the lowest foot carries the body."""
_CONTACT_HEIGHT = 0.045
_CONTACT_SPEED = 0.40
_HELD_STILL = 6
"""Frames over which a foot leaves the place where it was held."""


@dataclass(frozen=True)
class Grounded:
    """A motion that stands on the floor, and how well it did so before it was mended."""

    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    foot_contact: Float[np.ndarray, "frames 4"]
    """Left ankle, right ankle, left toe, right toe."""
    level: Float[np.ndarray, " frames"]
    """Height of what was stood on before it was lowered to the floor, metres."""
    skating: float
    """Mean speed of the planted feet before they were held still, metres per second."""


def ground(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
) -> Grounded:
    """Lower the motion to the floor and hold planted feet still.

    Args:
        body: whose soles to use.
        root: pelvis, world, metres, at any height.
        rotations: global R_world_joint.
    """
    soles = sole_points(body, root, rotations)
    level = _support_level(soles)
    root = root - np.array([0.0, 0.0, 1.0]) * level[:, None]
    soles = soles - np.array([0.0, 0.0, 1.0]) * level[:, None, None]
    rotations = _level_toes(rotations, soles)
    contact = foot_contacts(soles)
    rotations = _hold_feet(body, root, rotations, soles, contact)
    return Grounded(
        root=root,
        rotations=rotations,
        foot_contact=contact.astype(float),
        level=level,
        skating=foot_skating(soles, contact),
    )


def foot_contacts(soles: Float[np.ndarray, "frames 4 3"]) -> Bool[np.ndarray, "frames 4"]:
    """Heels and balls that are low and slow, without flicker."""
    planted = (soles[..., 2] < _CONTACT_HEIGHT) & (_speed(soles) < _CONTACT_SPEED)
    column = np.ones((3, 1), bool)
    return binary_opening(binary_closing(planted, column), column)


def foot_skating(
    soles: Float[np.ndarray, "frames 4 3"], contact: Bool[np.ndarray, "frames 4"]
) -> float:
    """Mean horizontal speed of heels and balls while planted, metres per second."""
    both = contact[1:] & contact[:-1]
    if not both.any():
        return 0.0
    moved = np.linalg.norm(np.diff(soles[..., :2], axis=0), axis=-1) * FPS
    return float(moved[both].mean())


def _support_level(soles: Float[np.ndarray, "frames 4 3"]) -> Float[np.ndarray, " frames"]:
    """Height of what the feet stand on: the lowest slow sole, interpolated over flight, smooth."""
    lowest = soles[..., 2].argmin(axis=1)
    rows = np.arange(len(soles))
    height = soles[rows, lowest, 2]
    carried = _speed(soles)[rows, lowest] < _SUPPORT_SPEED
    if not carried.any():
        carried = height <= np.quantile(height, 0.1)
    return gaussian_filter1d(np.interp(rows, rows[carried], height[carried]), 4.0, mode="nearest")


def _speed(points: Float[np.ndarray, "frames 4 3"]) -> Float[np.ndarray, "frames 4"]:
    return np.linalg.norm(np.gradient(points, 1.0 / FPS, axis=0), axis=-1)


def _level_toes(
    rotations: Float[np.ndarray, "frames 22 3 3"], soles: Float[np.ndarray, "frames 4 3"]
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Near the floor the toes stay level when the heel rises, instead of digging in."""
    out = rotations.copy()
    for side, j in enumerate(TOES):
        forward = rotations[:, j, :, 2]
        down = np.arcsin((-forward[:, 2]).clip(0.0, np.sin(np.pi / 3)))
        near = ((0.12 - soles[:, 2 + side, 2]) / 0.08).clip(0.0, 1.0)
        angle = gaussian_filter1d(-down * near, 1.5, mode="nearest")
        c, s, one = np.cos(angle), np.sin(angle), np.ones(len(angle))
        flex = np.zeros((len(angle), 3, 3))
        flex[:, 0, 0], flex[:, 1, 1], flex[:, 2, 2] = one, c, c
        flex[:, 1, 2], flex[:, 2, 1] = -s, s
        out[:, j] = rotations[:, j] @ flex
    return out


def _hold_feet(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    soles: Float[np.ndarray, "frames 4 3"],
    contact: Bool[np.ndarray, "frames 4"],
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Solve the legs such that each planted heel or ball stays where it was on average."""
    at = torch.as_tensor(root)
    turned = torch.as_tensor(rotations)
    ankles = forward_kinematics(body, at, turned).numpy()[:, list(ANKLES)]
    for side, leg in enumerate(_LEGS):
        drift = _drift(soles[:, side], contact[:, side], soles[:, 2 + side], contact[:, 2 + side])
        goal = torch.as_tensor(ankles[:, side] - drift)
        turned, _ = reach(body, at, turned, leg, goal)
    return turned.numpy()


def _drift(
    heel: Float[np.ndarray, "frames 3"],
    heel_down: Bool[np.ndarray, " frames"],
    ball: Float[np.ndarray, "frames 3"],
    ball_down: Bool[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 3"]:
    """How far the foot is from where it should stay, fading out while it is in the air."""
    frames = len(heel)
    total, count = np.zeros((frames, 3)), np.zeros(frames)
    for point, down in ((heel, heel_down), (ball, ball_down)):
        for first, last in runs(down):
            held = point[first:last]
            away = held - np.median(held, axis=0)
            away[:, 2] = held[:, 2]
            total[first:last] += away
            count[first:last] += 1
    known = np.flatnonzero(count)
    if len(known) == 0:
        return total
    total[known] /= count[known, None]
    distance = np.abs(np.arange(frames)[:, None] - known[None, :])
    nearest = distance.argmin(axis=1)
    gap = distance[np.arange(frames), nearest]
    fade = (0.5 + 0.5 * np.cos(np.pi * (gap / _HELD_STILL).clip(0.0, 1.0)))[:, None]
    return gaussian_filter1d(total[known[nearest]] * fade, 1.0, axis=0, mode="nearest")
