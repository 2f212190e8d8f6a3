"""What is wrong with a clip of somebody who moves an object: numbers, and the flags they raise.

Everything is measured on the finished clip, so recorded, synthetic and generated motion compare.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import sole_points
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local, turning_speed
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import foot_skating
from omomo_core.learning.recordings.joint_angles import SIDES, Hinge, elbow, knee, twist, wrist
from omomo_core.learning.recordings.penetration import body_in_object
from omomo_core.motion import FPS, ObjectMotion

_MOVING, _TURNING = 0.04, 0.25
"""An object slower than this, metres and radians per second, is at rest."""
_NEAR_BODY = 0.12
"""A joint this near the surface may be pushing it, metres: a foot, a hip."""
_SUPPORT_HEIGHT, _SUPPORT_EDGE = 0.03, 0.05


@dataclass(frozen=True)
class Quality:
    """Numbers of one clip; centimetres, degrees and frames as their names say."""

    name: str
    palm_off_cm: float
    """From the palms that touch to the surface, at worst one frame in twenty."""
    palm_slip_cm: float
    """How far a palm wanders on the object within one touch, at most."""
    trunk_depth_cm: float
    """Deepest the object's surface is inside the flesh of head and trunk."""
    leg_depth_cm: float
    arm_depth_cm: float
    hand_depth_cm: float
    lowest_cm: float
    """Lowest point of the object above the floor, at its lowest."""
    floating_frames: int
    """Frames in which the object moves and nobody is near, or no hand is on it above the floor."""
    toppling_frames: int
    """Frames at rest, unheld, with its middle not above what it stands on."""
    rest_height_cm: float
    """Of the object's lowest point while it rests unheld, at most: what it stands on is not drawn."""
    skating_cm_s: float
    sole_depth_cm: float
    """Deepest the soles are under the floor."""
    jerk_m_s3: float
    """Greatest third derivative of any joint's path."""
    elbow_min_deg: float
    """Least bending; negative is beyond straight."""
    elbow_max_deg: float
    knee_min_deg: float
    knee_max_deg: float
    hinge_aside_deg: float
    """Most bending of an elbow or a knee to the side."""
    shoulder_twist_deg: float
    """Most turn of an upper arm about itself, against the collar."""
    wrist_bend_deg: float
    flags: tuple[str, ...] = ()


_LIMITS: dict[str, Callable[[Quality], bool]] = {
    "palm off": lambda q: q.palm_off_cm > 5.0,
    "palm slips": lambda q: q.palm_slip_cm > 8.0,
    "object in trunk": lambda q: q.trunk_depth_cm > 6.0,
    "object in leg": lambda q: q.leg_depth_cm > 4.0,
    "object in arm": lambda q: q.arm_depth_cm > 2.5,
    "object in hand": lambda q: q.hand_depth_cm > 1.6,
    "under floor": lambda q: q.lowest_cm < -2.0,
    "floats": lambda q: q.floating_frames > 3,
    "topples": lambda q: q.toppling_frames > 3,
    "skates": lambda q: q.skating_cm_s > 12.0,
    "soles under floor": lambda q: q.sole_depth_cm > 5.0,
    "jerks": lambda q: q.jerk_m_s3 > 4000.0,
    "elbow broken": lambda q: q.elbow_min_deg < -15.0 or q.elbow_max_deg > 160.0,
    "knee broken": lambda q: q.knee_min_deg < -12.0 or q.knee_max_deg > 160.0,
    "hinge aside": lambda q: q.hinge_aside_deg > 45.0,
    "shoulder wrung": lambda q: q.shoulder_twist_deg > 150.0,
    "wrist bent": lambda q: q.wrist_bend_deg > 85.0,
}


def judge(clip: Clip, body: BodyModel, stride: int = 4) -> Quality:
    """Measure a clip and flag what is out of bounds.

    Args:
        clip: with an object.
        body: whose proportions the clip has.
        stride: penetration, the slow part, is measured at every so many frames.
    """
    assert clip.object_motion is not None
    root, rotations = (x.astype(np.float64) for x in (clip.root, clip.rotations))
    motion = replace(
        clip.object_motion, T_world_object=clip.object_motion.T_world_object.astype(np.float64)
    )
    joints = joints_of(body, root, rotations)
    soles = sole_points(body, root, rotations)
    depth = body_in_object(body, root[::stride], rotations[::stride], motion, stride)
    elbows, knees = [elbow(rotations, s) for s in SIDES], [knee(rotations, s) for s in SIDES]
    elbow_range, knee_range = _range(elbows), _range(knees)
    twists = [twist(rotations, f"{s}_shoulder", f"{s}_collar") for s in SIDES]
    floating, toppling, rest_height = _support(motion, joints, clip.hand_contact > 0.5)
    quality = Quality(
        name=clip.name,
        palm_off_cm=_palm_off(motion, joints, clip.hand_contact > 0.5),
        palm_slip_cm=_palm_slip(motion, joints, clip.hand_contact > 0.5),
        lowest_cm=100.0 * float(_lowest(motion).min()),
        floating_frames=floating,
        toppling_frames=toppling,
        rest_height_cm=rest_height,
        skating_cm_s=100.0 * foot_skating(soles, clip.foot_contact > 0.5),
        sole_depth_cm=-100.0 * min(float(soles[..., 2].min()), 0.0),
        jerk_m_s3=float(np.linalg.norm(np.diff(joints, 3, axis=0), axis=-1).max()) * FPS**3,
        trunk_depth_cm=100.0 * float(depth["trunk"].max()),
        leg_depth_cm=100.0 * float(depth["leg"].max()),
        arm_depth_cm=100.0 * float(depth["arm"].max()),
        hand_depth_cm=100.0 * float(depth["hand"].max()),
        elbow_min_deg=elbow_range[0],
        elbow_max_deg=elbow_range[1],
        knee_min_deg=knee_range[0],
        knee_max_deg=knee_range[1],
        hinge_aside_deg=float(np.abs([h.aside for h in elbows + knees]).max()),
        shoulder_twist_deg=float(np.abs(twists).max()),
        wrist_bend_deg=max(float(wrist(joints, side).max()) for side in SIDES),
    )
    return replace(quality, flags=tuple(k for k, bad in _LIMITS.items() if bad(quality)))


def _range(hinges: list[Hinge]) -> tuple[float, float]:
    flexion = np.concatenate([h.flexion for h in hinges])
    return float(flexion.min()), float(flexion.max())


def _palm_off(
    motion: ObjectMotion,
    joints: Float[np.ndarray, "frames 24 3"],
    touching: Bool[np.ndarray, "frames 2"],
) -> float:
    palms = to_local(motion.T_world_object, joints[:, 22:])[touching]
    if len(palms) == 0:
        return 0.0
    distance = sample_surface(motion.mesh).tree.query(palms)[0]
    return 100.0 * float(np.quantile(distance, 0.95))


def _palm_slip(
    motion: ObjectMotion,
    joints: Float[np.ndarray, "frames 24 3"],
    touching: Bool[np.ndarray, "frames 2"],
) -> float:
    palms = to_local(motion.T_world_object, joints[:, 22:])
    worst = 0.0
    for hand in range(2):
        for first, last in runs(touching[:, hand]):
            path = palms[first:last, hand]
            worst = max(worst, float(np.linalg.norm(path - np.median(path, axis=0), axis=1).max()))
    return 100.0 * worst


def _lowest(motion: ObjectMotion) -> Float[np.ndarray, " frames"]:
    """Height of the object's lowest vertex, metres."""
    up = motion.T_world_object[:, 2]
    return (motion.mesh.vertices @ up[:, :3].T).min(axis=0) + up[:, 3]


def _support(
    motion: ObjectMotion,
    joints: Float[np.ndarray, "frames 24 3"],
    touching: Bool[np.ndarray, "frames 2"],
) -> tuple[int, int, float]:
    """Frames that float, frames that should topple, and the greatest height rested at, cm."""
    T = motion.T_world_object
    surface, lowest = sample_surface(motion.mesh), _lowest(motion)
    centre = T[:, :3, :3] @ surface.centre + T[:, :3, 3]
    speed = np.linalg.norm(np.gradient(centre, 1 / FPS, axis=0), axis=-1)
    moving = (speed > _MOVING) | (turning_speed(T[:, :3, :3], FPS) > _TURNING)
    free = ~touching.any(axis=1)
    near = np.zeros(len(T), bool)
    if (free & moving).any():
        points = to_local(T, joints)[free & moving]
        near[free & moving] = surface.tree.query(points)[0].min(axis=1) < _NEAR_BODY
    # A foot may push what stands on the floor; what is in the air needs a hand.
    floating = free & moving & (~near | (lowest > 0.1))
    rests = free & ~moving
    rest_height = 100.0 * float(lowest[rests].max()) if rests.any() else 0.0
    toppling = sum(not _stable(motion, T[t], centre[t]) for t in np.flatnonzero(rests)[::5]) * 5
    return int(floating.sum()), toppling, rest_height


def _stable(
    motion: ObjectMotion, T: Float[np.ndarray, "4 4"], centre: Float[np.ndarray, " 3"]
) -> bool:
    """Is the middle above the polygon of what touches the ground, within a few centimetres?"""
    points = motion.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    feet = points[points[:, 2] < points[:, 2].min() + _SUPPORT_HEIGHT][:, :2] - centre[:2]
    # Outside the polygon there is a direction in which every foot lies on the far side.
    angles = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    reach = feet @ np.stack([np.cos(angles), np.sin(angles)])
    return bool(reach.max(axis=0).min() > -_SUPPORT_EDGE)
