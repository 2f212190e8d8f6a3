"""The views of a motion: from which cameras it is seen, and what is drawn for them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from omomo_core.skeleton import joint
from render.actors import Actor
from render.cameras import Camera, look_at, pinhole, quarter_turns
from render.follow import FollowStyle, behind, framed
from render.hand_view import hand_cameras
from render.props import BODY_COLOR, trail
from render.third_person import facing, follow_motion, object_corners, subject

View = Literal["third", "orbit", "follow", "top", "object", "hands"]

_CIRCLE = 16.0
"""Seconds that the orbiting camera takes for a full circle."""
_ABOVE = FollowStyle(elevation=0.42, fov_y=0.62)
_MAP_HEIGHT, _MAP_MARGIN, _MAP_LEAST = 30.0, 0.45, 1.5
"""Metres: of the camera over the map, around what is used of the ground, and half a map's side."""
_TRACK = 0.018
"""Radius of the tracks on the map, metres."""
DIAGONAL = np.radians(78.0)
"""Between opposite corners of the picture of a phone's wide camera."""
_SEEN = 0.1
"""Part of the frames in which a phone on the object shows a joint of the person, at least."""
_BACK, _UP = 0.95, 0.5
"""Metres behind and over the object for an eye that no phone gives."""


@dataclass(frozen=True)
class Eye:
    """A camera that rides on the object."""

    T_object_camera: Float[np.ndarray, "4 4"]
    """ARKit's axes: x right, y up, z toward the viewer."""
    diagonal: float = DIAGONAL
    """Between opposite corners of its picture, radians."""


@dataclass(frozen=True)
class Shot:
    """How a motion is seen."""

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
        if share_shown(human.joints, cameras, width, height) > _SEEN:
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
    """What the eye sees, turned by quarters so that up is up; the same angle across the corners."""
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
