"""Which synthetic clips are fit to learn from; the rest are thrown away with a reason."""

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.body.model import BodyModel
from omomo_core.data.grounding import foot_contacts, foot_skating, sole_points
from omomo_core.data.retarget import joints_of
from omomo_core.data.synthesis.actor import Performance
from omomo_core.data.synthesis.hands import Hands
from omomo_core.data.synthesis.script import Script
from omomo_core.data.synthesis.shapes import Part
from omomo_core.data.synthesis.stage import Stage
from omomo_core.data.synthesis.trajectory import Handling
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_PALM_OFF = 0.02
_DEEPEST = 0.05
_INSIDE_FRAMES = 6
"""Frames in which a joint may be inside the prop before the clip is dropped."""
_WALKED_THROUGH = 3
"""Frames in which somebody may stand in the place of a resting prop."""
_MARGIN = 0.02
_MORE_SKATING = 0.06
_FASTEST_TURN = 18.0
"""Radians per second of any joint."""
_FASTEST_PALM = 5.0
_JERKIEST = 90.0
"""Metres per second squared of any joint; real steps reach 60."""
_WRIST_BEND = np.radians(85)
_LOWER_BODY = ("pelvis", "left_knee", "right_knee", "left_ankle", "right_ankle",
               "left_foot", "right_foot")  # fmt: skip
_HARD_POINTS = ("pelvis", "spine2", "spine3", "neck", "head", "left_knee", "right_knee",
                "left_ankle", "right_ankle", "left_foot", "right_foot")  # fmt: skip


def walked_through(body: BodyModel, stage: Stage, script: Script, handling: Handling) -> bool:
    """Does the base motion lead through the place where the prop stands before or after?"""
    T = handling.T_world_prop
    joints = joints_of(body, stage.root, stage.rotations)
    points = joints[:, [joint(n) for n in _LOWER_BODY]] - T[:, None, :3, 3]
    local = np.einsum("tji,tpj->tpi", T[:, :3, :3], points)
    free = np.ones(len(T), bool)
    free[handling.first : handling.last] = False
    low, high = script.prop.low + _MARGIN, script.prop.high - _MARGIN
    within = (local[..., :2] > low[:2]) & (local[..., :2] < high[:2])
    return int((within.all(axis=-1).any(axis=1) & free).sum()) > _WALKED_THROUGH


def fault(
    body: BodyModel,
    stage: Stage,
    script: Script,
    handling: Handling,
    hands: Hands,
    performance: Performance,
) -> str | None:
    """The first reason to reject a clip, or None."""
    if np.quantile(performance.residual.max(axis=1), 0.99) > _PALM_OFF:
        return "palm-off"
    joints = joints_of(body, performance.root, performance.rotations)
    if _inside(script.prop.parts, handling, joints).sum() > _INSIDE_FRAMES:
        return "penetration"
    if _skating(body, performance) > _skating(body, stage) + _MORE_SKATING:
        return "skating"
    turns = np.swapaxes(performance.rotations[:-1], -1, -2) @ performance.rotations[1:]
    cosine = (np.trace(turns, axis1=-2, axis2=-1) - 1) / 2
    if np.arccos(cosine.clip(-1, 1)).max() * FPS > _FASTEST_TURN:
        return "too-fast"
    if np.linalg.norm(np.diff(joints[:, 22:], axis=0), axis=-1).max() * FPS > _FASTEST_PALM:
        return "too-fast"
    if np.linalg.norm(np.diff(joints, 2, axis=0), axis=-1).max() * FPS**2 > _JERKIEST:
        return "jerky"
    return "wrist" if _wrist_bend(joints, hands).max() > _WRIST_BEND else None


def _inside(
    parts: list[Part], handling: Handling, joints: Float[np.ndarray, "frames 24 3"]
) -> Bool[np.ndarray, " frames"]:
    """Frames with a joint deeper in a part of the prop than flesh allows."""
    T = handling.T_world_prop
    points = joints[:, [joint(n) for n in _HARD_POINTS]] - T[:, None, :3, 3]
    local = np.einsum("tji,tpj->tpi", T[:, :3, :3], points)
    inside = np.zeros(len(T), bool)
    for part in parts:
        # Thin parts count too: a leg passing through a board is wrong at any depth.
        depth = np.minimum(_DEEPEST, (part.high - part.low) * 0.25)
        within = (local > part.low + depth) & (local < part.high - depth)
        inside |= within.all(axis=-1).any(axis=1)
    return inside


def _skating(body: BodyModel, motion: Stage | Performance) -> float:
    soles = sole_points(body, motion.root, motion.rotations)
    return foot_skating(soles, foot_contacts(soles))


def _wrist_bend(
    joints: Float[np.ndarray, "frames 24 3"], hands: Hands
) -> Float[np.ndarray, "frames 2"]:
    """Angle between forearm and hand of holding hands."""
    forearm = joints[:, 20:22] - joints[:, 18:20]
    hand = joints[:, 22:] - joints[:, 20:22]
    cosine = (forearm * hand).sum(-1) / (
        np.linalg.norm(forearm, axis=-1) * np.linalg.norm(hand, axis=-1)
    )
    return np.arccos(cosine.clip(-1.0, 1.0)) * (hands.contact > 0)
