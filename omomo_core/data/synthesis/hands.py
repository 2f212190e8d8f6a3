"""Where the palms go and how the hands are turned: toward the prop, on it, away from it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from omomo_core.data.synthesis.script import Script
from omomo_core.data.synthesis.trajectory import Handling, min_jerk

PALM_THICKNESS = 0.02
"""From the skin of the palm to the palm joint inside the hand, metres."""
_DETOUR = 0.12
"""How far outside the straight line a hand swings on its way, metres."""


@dataclass(frozen=True)
class Hands:
    """Goals of both hands; index 0 is left, 1 right."""

    palms: Float[np.ndarray, "frames 2 3"]
    """Palm joints while held, world, metres (on the resting prop before and after)."""
    R_world_wrist: Float[np.ndarray, "frames 2 3 3"]
    outward: Float[np.ndarray, "frames 2 3"]
    """Away from the surface, metres: the detour of a hand that is half way."""
    pull: Float[np.ndarray, "frames 2"]
    """0 where the hand is free, 1 where it holds, smooth between."""
    contact: Float[np.ndarray, "frames 2"]


def plan_hands(
    script: Script, handling: Handling, fingers: Float[np.ndarray, "2 3"] | None = None
) -> Hands:
    """Goals for both hands from the prop's motion.

    Args:
        script: how the prop is held.
        handling: where it goes.
        fingers: where each hand's fingers should point, prop frame (see `forearms`); by default a
            guess from how high the hands are.
    """
    T = handling.T_world_prop
    frames = len(T)
    if script.grasp.fingers is not None:
        fingers = np.tile(script.grasp.fingers, (2, 1))
    elif fingers is None:
        fingers = _guessed_fingers(script, handling)
    inward = script.grasp.inward
    R_prop_wrist = _hand_rotations(inward, fingers)
    anchors = script.grasp.points - inward * PALM_THICKNESS
    t = np.arange(frames)
    coming = min_jerk((t - handling.first + script.reach) / script.reach)
    going = min_jerk((handling.last - 1 + script.release - t) / script.release)
    pull = (coming if script.takes else 1.0) * (going if script.leaves else np.ones(frames))
    held = ((t >= handling.first) & (t < handling.last)).astype(float)
    used = np.array(script.hands, float)
    return Hands(
        palms=np.einsum("tij,hj->thi", T[:, :3, :3], anchors) + T[:, None, :3, 3],
        R_world_wrist=np.einsum("tij,hjk->thik", T[:, :3, :3], R_prop_wrist),
        outward=-_DETOUR * np.einsum("tij,hj->thi", T[:, :3, :3], inward),
        pull=pull[:, None] * used,
        contact=held[:, None] * used,
    )


def forearms(
    handling: Handling, joints: Float[np.ndarray, "frames 24 3"]
) -> Float[np.ndarray, "2 3"]:
    """Mean direction of both forearms while they hold the prop, prop frame."""
    rows = slice(handling.first, handling.last)
    along = joints[rows, 20:22] - joints[rows, 18:20]
    return np.einsum("tji,thj->hi", handling.T_world_prop[rows, :3, :3], along)


def _guessed_fingers(script: Script, handling: Handling) -> Float[np.ndarray, "2 3"]:
    """Fingers along forearms that point down to a low hand and up to a high one."""
    T = handling.T_world_prop[handling.first : handling.last]
    height = np.einsum("tij,hj->thi", T[:, :3, :3], script.grasp.points) + T[:, None, :3, 3]
    drop = np.interp(height[..., 2], [0.1, 0.7, 1.05, 1.3, 1.7], [1.35, 0.95, 0.4, -0.15, -1.2])
    return np.stack([np.cos(drop), 0.0 * drop, -np.sin(drop)], axis=-1).mean(axis=0)


def _hand_rotations(
    inward: Float[np.ndarray, "2 3"], fingers: Float[np.ndarray, "2 3"]
) -> Float[np.ndarray, "2 3 3"]:
    """R_prop_wrist of each hand: palm on the surface, fingers as nearly as possible as wished."""
    flat = fingers - inward * (inward * fingers).sum(-1, keepdims=True)
    flat /= np.linalg.norm(flat, axis=-1, keepdims=True)
    x = flat * np.array([[1.0], [-1.0]])
    return np.stack([x, -inward, np.cross(x, -inward)], axis=-1)
