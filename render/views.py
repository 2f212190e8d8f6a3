"""The views of a motion, and cameras that keep close to the hands."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d

from omomo_core.geometry.surface import Triangles
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from omomo_core.skeleton import joint
from render.cameras import Camera, FollowStyle, behind, framed, look_at, pinhole, quarter_turns
from render.props import BODY_COLOR, Actor, trail
from render.third_person import facing, follow_motion, object_corners, subject

_WRISTS = [joint("left_wrist"), joint("right_wrist")]
_PALMS = slice(22, 24)
_BOTH = 0.4
"""Distance of palms up to which both are in the picture, metres."""
_DISTANCE = 0.5
"""Distance of the camera from a single hand, metres."""
_MARGIN = 1.1
"""What is added to that distance, metres for each metre between two hands."""
_DIRECTIONS = (
    (0.55, 0.75, 0.35), (0.75, 0.2, 0.35), (0.3, 0.9, 0.0), (0.3, 0.3, 1.0), (0.55, -0.6, 0.35),
    (0.75, 0.2, -0.3), (-0.55, 0.75, 0.35), (0.1, -0.9, 0.2), (0.2, 0.2, -1.0),
    (-0.3, -0.8, 0.35), (-0.2, 0.3, 1.0), (0.1, 0.9, 0.6),
)  # fmt: skip
"""From the hands to the camera, the best view first: how much along the back of the hand, along the thumb's
side, and upwards."""
_HANDS_SEEN = 0.8
"""Visible share of the hands that is enough, so that no further direction is tried."""
_REACH = 0.06
"""Distance from a palm to the middle of the fingers, metres."""
_HALF = 0.035
"""Distance from a palm to the rims of the hand, metres."""
_TRUNK = [joint(n) for n in ("pelvis", "spine1", "spine2", "spine3", "neck", "head")]
_THIGHS = (
    [joint(n) for n in ("left_hip", "right_hip")],
    [joint(n) for n in ("left_knee", "right_knee")],
)
_GIRTH = 0.14
"""Radius of trunk, head and thighs, metres."""
_LOWEST = 0.05
"""Least height of the camera above the floor, metres."""
_STRIDE = 10
"""Interval of the frames in which visibility is tested."""
_FOV = 0.5
"""Vertical field of view, radians."""
_TARGET_SMOOTHING = 4.0
"""Standard deviation of the filter over what the camera looks at, frames."""
_SMOOTHING = 10.0
"""Standard deviation of the filter over the direction of the camera, frames."""


def hand_cameras(human: HumanMotion, moved: ObjectMotion, width: int, height: int) -> list[Camera]:
    """Return one camera per frame that looks at both hands if they are near each other, else at one.

    It looks at the hand that holds for longer, from a side on which neither the object nor the body hides it.

    Args:
        human: whose hands.
        moved: the object, in the same frames.
        width, height: of the pictures, pixels.
    """
    palms = human.joints[:, _PALMS]
    shown = _shown(palms, human.hand_contact)
    target = palms[:, shown].mean(axis=1)
    target = gaussian_filter1d(target, _TARGET_SMOOTHING, axis=0, mode="nearest")
    apart = (
        np.linalg.norm(np.ptp(palms[:, shown], axis=1), axis=-1).max() if len(shown) > 1 else 0.0
    )
    far, most, eye = _DISTANCE + _MARGIN * apart, -1.0, target
    surface = Triangles(moved.mesh.vertices, moved.mesh.faces)
    for parts in _DIRECTIONS:
        tried = target + far * _direction(human, shown, parts)
        seen = _visible_share(human, moved, surface, shown, tried)
        if seen > most:
            most, eye = seen, tried
        if seen >= _HANDS_SEEN:
            break
    return [pinhole(look_at(eye[k], target[k]), _FOV, width, height) for k in range(len(eye))]


def _direction(
    human: HumanMotion, shown: list[int], parts: tuple[float, float, float]
) -> Float[np.ndarray, "frames 3"]:
    """Return the direction from the hands to the camera."""
    back, thumb, up = parts
    R = human.rotations[:, _WRISTS][:, shown]
    direction = (back * R[..., 1] + thumb * R[..., 2]).mean(axis=1)
    direction[:, 2] += up
    direction = gaussian_filter1d(direction, _SMOOTHING, axis=0, mode="nearest")
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def _visible_share(
    human: HumanMotion,
    moved: ObjectMotion,
    surface: Triangles,
    shown: list[int],
    eye: Float[np.ndarray, "frames 3"],
) -> float:
    """Return the share of the holding hands that neither the object nor the body hides from the camera."""
    held = np.flatnonzero((human.hand_contact[:, shown] > 0.5).any(axis=1))[::_STRIDE]
    if not len(held):
        return 1.0
    palms = human.joints[held][:, _PALMS][:, shown]
    along = palms - human.joints[held][:, _WRISTS][:, shown]
    along *= _REACH / np.linalg.norm(along, axis=-1, keepdims=True)
    across = _HALF * human.rotations[held][:, _WRISTS][:, shown][..., 2]
    points = np.stack([palms, palms + along, palms + across, palms - across], axis=2)
    points = points.reshape(len(held), -1, 3)
    eyes = np.broadcast_to(eye[held, None], points.shape)
    T = moved.T_world_object[held]
    hidden = surface.between(to_local(T, points), to_local(T, eyes))
    hidden |= _behind_body(human.joints[held], points, eyes) | (eyes[..., 2] < _LOWEST)
    return 1.0 - float(hidden.mean())


def _behind_body(
    joints: Float[np.ndarray, "held 24 3"],
    points: Float[np.ndarray, "held points 3"],
    eyes: Float[np.ndarray, "held points 3"],
) -> Bool[np.ndarray, "held points"]:
    """Return whether trunk, head or a thigh is between the points and the camera."""
    hips, knees = (joints[:, some] for some in _THIGHS)
    thick = np.concatenate([joints[:, _TRUNK], hips, 0.5 * (hips + knees), knees], axis=1)
    sight, to_joint = (eyes - points)[:, :, None], thick[:, None] - points[:, :, None]
    share = (to_joint * sight).sum(axis=-1) / (sight**2).sum(axis=-1)
    beside = to_joint - share.clip(0.0, 1.0)[..., None] * sight
    return (np.linalg.norm(beside, axis=-1) < _GIRTH).any(axis=-1)


def _shown(
    palms: Float[np.ndarray, "frames 2 3"], contact: Float[np.ndarray, "frames 2"]
) -> list[int]:
    """Return which hands to look at: 0 left, 1 right."""
    both = contact.min(axis=1) > 0.5
    if both.any():
        apart = np.linalg.norm(palms[both, 0] - palms[both, 1], axis=-1)
        if np.percentile(apart, 90) < _BOTH:
            return [0, 1]
    return [int(contact[:, 1].sum() > contact[:, 0].sum())]


View = Literal["third", "orbit", "follow", "top", "object", "hands"]

_CIRCLE = 16.0
"""Seconds that the orbiting camera takes for a full circle."""
_ABOVE = FollowStyle(elevation=0.42, fov_y=0.62)
_MAP_HEIGHT = 30.0
"""Height of the camera over the map, metres."""
_MAP_MARGIN = 0.45
"""Room on the map around what is used of the ground, metres."""
_MAP_LEAST = 1.5
"""Least half of a map's side, metres."""
_TRACK = 0.018
"""Radius of the tracks on the map, metres."""
DIAGONAL = np.radians(78.0)
"""Between opposite corners of the picture of a phone's wide camera."""
_JOINTS_SEEN = 0.1
"""Part of the frames in which a phone on the object shows a joint of the person, at least."""
_BACK = 0.95
"""Distance behind the object of a camera that no phone gives, metres."""
_UP = 0.5
"""Its height over the middle of the object, metres."""


@dataclass(frozen=True)
class Eye:
    """A camera that rides on the object."""

    T_object_camera: Float[np.ndarray, "4 4"]
    """ARKit's axes: x right, y up, z toward the viewer."""
    diagonal: float = DIAGONAL
    """Between opposite corners of its picture, radians."""


@dataclass(frozen=True)
class Shot:
    """The cameras of a motion, and what else its pictures need."""

    cameras: list[Camera]
    """One per frame."""
    tracks: Sequence[Actor] = ()
    """Drawn for this view alone."""
    pixels_per_metre: float | None = None
    """On the floor, where the whole picture has one scale."""


def shot(
    view: View,
    human: HumanMotion,
    moved: ObjectMotion,
    width: int,
    height: int,
    eye: Eye | None = None,
) -> Shot:
    """The cameras of a view.

    Args:
        view: "third" keeps person and object in a three-quarter front view, "orbit" circles them
            slowly, "follow" walks behind the person, "top" is a map of the whole motion, "object"
            sees what a camera on the object sees, and "hands" keeps close to the hands that hold.
        human, moved: of the same frames.
        width, height: of the pictures, pixels.
        eye: the camera on the object, for "object"; without it, or where it hardly ever sees the
            person, one that is fixed to the object and looks across it at them.
    """
    if view == "top":
        return _map(human, moved, width, height)
    if view == "object":
        return Shot(_on_object(human, moved, width, height, eye))
    if view == "hands":
        return Shot(hand_cameras(human, moved, width, height))
    if view == "third":
        return Shot(follow_motion(human, moved, width, height))
    turns = np.arange(len(human.root)) / FPS / _CIRCLE
    azimuth = 2 * np.pi * turns - 0.8 if view == "orbit" else behind(facing(human))
    return Shot(framed(subject(human, moved), azimuth, width, height, _ABOVE))


def _map(human: HumanMotion, moved: ObjectMotion, width: int, height: int) -> Shot:
    """Straight down from so high that the whole map has nearly one scale; +x right, +y up."""
    used = np.concatenate([human.joints, object_corners(moved)], axis=1)[..., :2]
    low, high = used.min(axis=(0, 1)), used.max(axis=(0, 1))
    middle = 0.5 * (low + high)
    half = np.maximum(0.5 * (high - low) + _MAP_MARGIN, _MAP_LEAST)
    up = max(float(half[1]), float(half[0]) * height / width)
    T = look_at(np.array([*middle, _MAP_HEIGHT]), np.array([*middle, 0.0]))
    camera = pinhole(T, 2 * float(np.arctan(up / _MAP_HEIGHT)), width, height)
    walked = human.root * [1.0, 1.0, 0.0] + [0.0, 0.0, _TRACK]
    track = trail(walked, _TRACK, name="walked", color=BODY_COLOR)
    return Shot([camera] * len(human.root), [track], camera.fy / _MAP_HEIGHT)


def _on_object(
    human: HumanMotion, moved: ObjectMotion, width: int, height: int, eye: Eye | None
) -> list[Camera]:
    if eye is not None:
        cameras = _riding(moved, eye, width, height)
        if share_shown(human.joints, cameras, width, height) > _JOINTS_SEEN:
            return cameras
    return _riding(moved, _across(human, moved), width, height)


def share_shown(
    points: Float[np.ndarray, "frames points 3"],
    cameras: Sequence[Camera],
    width: int,
    height: int,
) -> float:
    """Part of the frames in whose picture at least one of its points (world) is."""
    seen = np.stack([c.project(points[k]) for k, c in enumerate(cameras)])
    u, v, depth = np.moveaxis(seen, -1, 0)
    inside = (depth > 0) & (u > 0) & (u < width) & (v > 0) & (v < height)
    return float(np.any(inside, axis=-1).mean())


def _riding(moved: ObjectMotion, eye: Eye, width: int, height: int) -> list[Camera]:
    """Return what the eye sees, turned by quarters so that up is up; the same angle across the corners."""
    T = moved.T_world_object @ eye.T_object_camera
    angle = -quarter_turns(T) * np.pi / 2
    c, s = np.cos(angle), np.sin(angle)
    upright = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    fov_y = 2 * np.arctan(np.tan(eye.diagonal / 2) * height / np.hypot(width, height))
    return [pinhole(pose, float(fov_y), width, height) for pose in T @ upright]


def _across(human: HumanMotion, moved: ObjectMotion) -> Eye:
    """An eye beyond the object, seen from where the person's head mostly is."""
    T = moved.T_world_object
    head = human.joints[:, joint("head")]
    seen = np.einsum("fji,fj->fi", T[:, :3, :3], head - T[:, :3, 3])
    points = moved.mesh.vertices
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    way = np.median(seen, axis=0) - middle
    up = T[:, 2, :3].mean(axis=0)
    up /= max(float(np.linalg.norm(up)), 1e-6)
    way -= (way @ up) * up
    way /= max(float(np.linalg.norm(way)), 1e-6)
    beyond = float((-(points - middle) @ way).max()) + _BACK
    # `look_at` keeps the horizon of z: the object's frame is turned so that its mean up is z.
    R = np.stack([way, np.cross(up, way), up])
    eye = R @ (middle - beyond * way + _UP * up)
    T_object_camera = look_at(eye, R @ (middle + 0.3 * _UP * up))
    T_object_camera[:3] = R.T @ T_object_camera[:3]
    return Eye(T_object_camera)
