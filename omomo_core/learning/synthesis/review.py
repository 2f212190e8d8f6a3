"""Which synthetic clips are fit to learn from; the rest are thrown away with a reason."""

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import to_local, turning_speed
from omomo_core.learning.recordings.grounding import foot_contacts, foot_skating
from omomo_core.learning.recordings.quality import SIDES, body_in_object, elbow, twist, wrist
from omomo_core.learning.synthesis.actor import ActorMotion
from omomo_core.learning.synthesis.base_motion import BaseMotion
from omomo_core.learning.synthesis.holds import Handling
from omomo_core.learning.synthesis.palms_on_prop import Hands
from omomo_core.learning.synthesis.props import Prop
from omomo_core.learning.synthesis.shapes import SolidPart, joined
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from omomo_core.skeleton import BODY_JOINTS, joint

_PALM_OFF = 0.02
_DEEPEST = 0.05
_STRIDE = 20
"""Frames between those in which the skin is compared with the prop."""
_ELBOW = (-15.0, 162.0)
_ELBOW_ASIDE = 45.0
_ARM_TWIST = 150.0
"""Degrees; real elbows and upper arms stay well inside."""
_INSIDE_FRAMES = 6
"""Frames in which a joint may be inside the prop before the clip is dropped."""
_WALKED_THROUGH = 3
"""Frames in which somebody may stand in the place of a resting prop."""
_MARGIN, _UNDER = 0.02, 0.25
"""How far the pelvis, and legs and feet, may be within the outline of a resting prop: feet go under
tables and between legs of chairs, metres."""
_MORE_SKATING = 0.06
_FASTEST_TURNS = np.where([name.endswith("_foot") for name in BODY_JOINTS], 28.0, 18.0)
"""Radians per second of each joint; toes roll faster than anything else turns."""
_FASTEST_PALM = 5.0
_JERKIEST = 90.0
"""Metres per second squared of any joint; real steps reach 60."""
_LEAST_WAY, _LEAST_TURN = 0.12, 0.25
"""A clip in which the prop is moved less than both teaches nothing (metres, radians)."""
_WRIST_BEND = 85.0
"""Degrees between forearm and holding hand."""
_LOWER_BODY = ("pelvis", "left_knee", "right_knee", "left_ankle", "right_ankle",
               "left_foot", "right_foot")  # fmt: skip
_FREE = np.array([_MARGIN] + [_UNDER] * (len(_LOWER_BODY) - 1))[:, None]
_HARD_POINTS = ("pelvis", "spine2", "spine3", "neck", "head", "left_knee", "right_knee",
                "left_ankle", "right_ankle", "left_foot", "right_foot")  # fmt: skip


def walked_through(
    body: BodyModel, base_motion: BaseMotion, prop: Prop, handling: Handling
) -> bool:
    """Does the base motion lead through the place where the prop stands before or after?"""
    joints = joints_of(body, base_motion.root, base_motion.rotations)
    points = joints[:, [joint(n) for n in _LOWER_BODY], :2]
    vertices = np.concatenate([p.vertices for p in prop.parts])
    count = 0
    for first, last in runs(np.asarray(~handling.held.any(axis=1))):
        R = handling.T_world_prop[first, :3, :3]
        along = R[:2, np.linalg.norm(R[:2], axis=0).argmax()]
        axes = np.stack([along, [-along[1], along[0]]]) / np.linalg.norm(along)
        footprint = (vertices @ R.T + handling.T_world_prop[first, :3, 3])[:, :2] @ axes.T
        seen = points[first:last] @ axes.T
        within = seen > footprint.min(axis=0) + _FREE
        within &= seen < footprint.max(axis=0) - _FREE
        count += int(within.all(axis=-1).any(axis=1).sum())
    return count > _WALKED_THROUGH


def fault(
    body: BodyModel,
    base_motion: BaseMotion,
    prop: Prop,
    handling: Handling,
    hands: Hands,
    performance: ActorMotion,
) -> str | None:
    """The first reason to reject a clip, or None."""
    if _idle(handling):
        return "nothing-happens"
    if np.quantile(performance.residual.max(axis=1), 0.99) > _PALM_OFF:
        return "palm-off"
    joints = joints_of(body, performance.root, performance.rotations)
    if _inside(prop.parts, handling, joints).sum() > _INSIDE_FRAMES:
        return "penetration"
    if _skating(body, performance) > _skating(body, base_motion) + _MORE_SKATING:
        return "skating"
    turning = turning_speed(performance.rotations, FPS)
    if (turning > _FASTEST_TURNS).any():
        return "too-fast"
    if np.linalg.norm(np.diff(joints[:, 22:], axis=0), axis=-1).max() * FPS > _FASTEST_PALM:
        return "too-fast"
    if np.linalg.norm(np.diff(joints, 2, axis=0), axis=-1).max() * FPS**2 > _JERKIEST:
        return "jerky"
    if any(wrist(joints, s)[hands.contact[:, k] > 0].max(initial=0.0) > _WRIST_BEND
           for k, s in enumerate(SIDES)):  # fmt: skip
        return "wrist"
    if _wrung(performance.rotations):
        return "wrung-arm"
    return "trunk-inside" if _trunk_depth(body, prop, handling, performance) > _DEEPEST else None


def _wrung(rotations: Float[np.ndarray, "frames 22 3 3"]) -> bool:
    """An elbow beyond straight or bent aside, or an upper arm turned about itself as none can be."""
    for side in SIDES:
        hinge = elbow(rotations, side)
        if hinge.flexion.min() < _ELBOW[0] or hinge.flexion.max() > _ELBOW[1]:
            return True
        if np.abs(hinge.aside).max() > _ELBOW_ASIDE:
            return True
        if np.abs(twist(rotations, f"{side}_shoulder", f"{side}_collar")).max() > _ARM_TWIST:
            return True
    return False


def _trunk_depth(
    body: BodyModel, prop: Prop, handling: Handling, performance: ActorMotion
) -> float:
    """How deep the prop is in the trunk or the head, metres."""
    T = handling.T_world_prop
    mesh = ObjectMesh(*joined(prop.parts), prop.name)
    motion = ObjectMotion(mesh, T, np.ones(len(T), bool))
    rows = slice(None, None, _STRIDE)
    root, rotations = performance.root[rows], performance.rotations[rows]
    depth = body_in_object(body, root, rotations, motion, _STRIDE)
    return float(depth["trunk"].max())


def _idle(handling: Handling) -> bool:
    """The prop is hardly moved at all."""
    T = handling.T_world_prop
    way = np.linalg.norm(T[:, :3, 3] - T[0, :3, 3], axis=-1).max()
    cosine = (np.einsum("ij,tij->t", T[0, :3, :3], T[:, :3, :3]) - 1) / 2
    return bool(way < _LEAST_WAY and np.arccos(cosine.clip(-1, 1)).max() < _LEAST_TURN)


def _inside(
    parts: list[SolidPart], handling: Handling, joints: Float[np.ndarray, "frames 24 3"]
) -> Bool[np.ndarray, " frames"]:
    """Frames with a joint deeper in a part of the prop than flesh allows."""
    T = handling.T_world_prop
    points = to_local(T, joints[:, [joint(n) for n in _HARD_POINTS]])
    inside = np.zeros(len(T), bool)
    for part in parts:
        # Thin parts count too: a leg passing through a board is wrong at any depth.
        depth = np.minimum(_DEEPEST, (part.high - part.low) * 0.25)
        within = (points > part.low + depth) & (points < part.high - depth)
        inside |= np.any(within.all(axis=-1), axis=1)
    return inside


def _skating(body: BodyModel, motion: BaseMotion | ActorMotion) -> float:
    soles = sole_points(body, motion.root, motion.rotations)
    return foot_skating(soles, foot_contacts(soles))
