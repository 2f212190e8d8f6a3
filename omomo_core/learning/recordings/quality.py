"""What is wrong with a clip of somebody who moves an object: angles, penetration and flags."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from omomo_core.body.kinematics import full_kinematics, joints_of, skin, sole_points, vertex_normals
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local, turning_speed
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import foot_skating
from omomo_core.motion import FPS, ObjectMotion
from omomo_core.skeleton import ALL_JOINTS, BODY_JOINTS, joint

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Hinge:
    """Bending of a hinge joint, degrees."""

    flexion: Float[np.ndarray, " frames"]
    """0 straight, positive the natural way, negative beyond straight."""
    aside: Float[np.ndarray, " frames"]
    """Bending to the side, which neither elbows nor knees can."""


def elbow(rotations: Float[np.ndarray, "frames 22 3 3"], side: Side) -> Hinge:
    """Bending of an elbow against the upper arm's own hinge axis."""
    across = 1.0 if side == "left" else -1.0
    bone, hinge = np.array([across, 0.0, 0.0]), np.array([0.0, -across, 0.0])
    return _hinge(rotations, f"{side}_shoulder", f"{side}_elbow", bone, hinge)


def knee(rotations: Float[np.ndarray, "frames 22 3 3"], side: Side) -> Hinge:
    """Bending of a knee against the thigh's own hinge axis."""
    bone, hinge = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    return _hinge(rotations, f"{side}_hip", f"{side}_knee", bone, hinge)


def _hinge(
    rotations: Float[np.ndarray, "frames 22 3 3"],
    above: str,
    name: str,
    bone: Float[np.ndarray, " 3"],
    hinge: Float[np.ndarray, " 3"],
) -> Hinge:
    upper, lower = rotations[:, joint(above)], rotations[:, joint(name)]
    along = np.einsum("tji,tj->ti", upper, lower @ bone)
    # Measured from the half turn: 170 degrees of flexion must not read as -190.
    flexion = np.degrees(np.arctan2(along @ np.cross(hinge, bone), along @ bone))
    flexion = np.where(flexion < -90.0, flexion + 360.0, flexion)
    return Hinge(flexion, np.degrees(np.arcsin((along @ hinge).clip(-1.0, 1.0))))


def twist(
    rotations: Float[np.ndarray, "frames 22 3 3"], name: str, above: str
) -> Float[np.ndarray, " frames"]:
    """Turn of an arm's joint about its own bone against the joint above, degrees, 0 in the T-pose."""
    assert name in BODY_JOINTS
    turned = np.swapaxes(rotations[:, joint(above)], -1, -2) @ rotations[:, joint(name)]
    # The part of the quaternion along x, the bone's axis: swing-twist decomposition.
    x = turned[:, 2, 1] - turned[:, 1, 2]
    w = 1.0 + turned[:, 0, 0] + turned[:, 1, 1] + turned[:, 2, 2]
    return np.degrees(2.0 * np.arctan2(x, w))


def wrist(joints: Float[np.ndarray, "frames 24 3"], side: Side) -> Float[np.ndarray, " frames"]:
    """Angle between forearm and hand, degrees, 0 straight."""
    k = SIDES.index(side)
    a, b = joints[:, 20 + k] - joints[:, 18 + k], joints[:, 22 + k] - joints[:, 20 + k]
    cosine = (a * b).sum(-1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
    return np.degrees(np.arccos(cosine.clip(-1.0, 1.0)))


Depth = dict[str, Float[np.ndarray, " frames"]]
"""Metres, for "trunk", "leg", "arm" and "hand"; 0 where nothing is inside."""

PARTS = ("trunk", "leg", "arm", "hand")
_SURFACE_POINTS = 3000
_EVERY_VERTEX = 3


def body_in_object(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    motion: ObjectMotion,
    stride: int,
) -> Depth:
    """Deepest point of the object's surface inside each part of the body, frame by frame.

    Args:
        body: with a closed skin.
        root, rotations: of every `stride`-th frame.
        motion: of all frames.
        stride: between the frames that are measured.
    """
    points = sample_surface(motion.mesh, _SURFACE_POINTS).points
    part_of = _part_of_vertices(body)[::_EVERY_VERTEX]
    depth = {part: np.zeros(len(root)) for part in PARTS}
    for k, T in enumerate(motion.T_world_object[::stride]):
        vertices, normals = _skin(body, root[k], rotations[k])
        world = points @ T[:3, :3].T + T[:3, 3]
        inside = world[_within(world, vertices)]
        if len(inside) == 0:
            continue
        distance, nearest = KDTree(vertices[::_EVERY_VERTEX]).query(inside)
        nearest_vertex = nearest * _EVERY_VERTEX
        beyond = ((inside - vertices[nearest_vertex]) * normals[nearest_vertex]).sum(-1)
        # The way out along the normal; the straight distance is longer between two vertices.
        deep = np.where(beyond < 0.0, np.minimum(distance, -beyond), 0.0)
        for number, part in enumerate(PARTS):
            depth[part][k] = deep[part_of[nearest] == number].max(initial=0.0)
    return depth


def _skin(
    body: BodyModel, root: Float[np.ndarray, " 3"], rotations: Float[np.ndarray, "22 3 3"]
) -> tuple[Float[np.ndarray, "verts 3"], Float[np.ndarray, "verts 3"]]:
    at, turned = torch.as_tensor(root).float(), torch.as_tensor(rotations).float()
    with torch.inference_mode():
        vertices = skin(body, *full_kinematics(body, at, turned, body.relaxed_fingers))
        return vertices.numpy(), vertex_normals(vertices, body.faces).numpy()


def _within(
    points: Float[np.ndarray, "points 3"], vertices: Float[np.ndarray, "verts 3"]
) -> Bool[np.ndarray, " points"]:
    """Points in the box around the body: most of a large object is not."""
    return ((points > vertices.min(axis=0)) & (points < vertices.max(axis=0))).all(axis=1)


def _part_of_vertices(body: BodyModel) -> Int[np.ndarray, " verts"]:
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    bone = body.skin_joints.gather(1, strongest)[:, 0].numpy()
    return np.array([PARTS.index(_part(name)) for name in ALL_JOINTS])[bone]


def _part(name: str) -> str:
    bare = name.removeprefix("left_").removeprefix("right_")
    if bare in ("hip", "knee", "ankle", "foot"):
        return "leg"
    if bare in ("shoulder", "elbow"):
        return "arm"
    return "trunk" if bare == name or bare == "collar" else "hand"


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
    """Height (cm) of the object's lowest point at rest, at most: what it stands on is not drawn."""
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
