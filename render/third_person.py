"""The person, the object with its contact patches, and the floor from a following camera."""

from collections.abc import Callable, Generator, Sequence

import numpy as np
import torch
import trimesh
from jaxtyping import Float, UInt8

from omomo_core.body.kinematics import full_kinematics, skin
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import InputError
from omomo_core.geometry.surface import Surface, sample_surface
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from omomo_core.skeleton import joint
from render.backends import Backend, open_renderer
from render.cameras import Camera, FollowStyle, follow
from render.lettering import caption
from render.props import (
    BODY_COLOR,
    CONTACT_COLOR,
    Actor,
    ball,
    contact_marker,
    floor,
    play,
    rigid_object,
    trail,
)
from render.scene import Color, Drawable, Light, Scene

_CHUNK = 32
_CROWN = 0.22
"""Metres from the head joint to the top of the hair."""

_PATCH_RADIUS = 0.042
"""Radius of a contact patch, metres."""
_PATCH_THICKNESS = 0.004
"""Thickness of a contact patch, metres."""


def frames(
    human: HumanMotion,
    object_motion: ObjectMotion,
    body: BodyModel,
    *,
    width: int = 960,
    height: int = 540,
    backend: Backend = "auto",
    label: str = "",
    markers: bool = True,
    time_code: bool = True,
    cameras: Sequence[Camera] | None = None,
    samples: int = 0,
    extra: Sequence[Actor] = (),
    pixels_per_metre: float | None = None,
    only: Sequence[int] | None = None,
    instead: Sequence[Actor] = (),
) -> Generator[UInt8[np.ndarray, "h w 3"]]:
    """Pictures of a motion at 30 fps, one at a time; the body is skinned as they are drawn.

    Args:
        human, object_motion: of the same frames.
        body: whose skin to draw.
        width, height: pixels; even numbers suit video.
        backend: see `open_renderer`.
        label: written in the top left corner.
        markers: draw the palms' contacts and the object's trail.
        time_code: write the time of the recording in the bottom left corner.
        cameras: one per frame, in place of the following camera.
        samples: multisampling, see `open_renderer`.
        extra: more to draw, of the same frames.
        pixels_per_metre: draw a scale bar of one metre.
        only: the frames to draw, seen as in the whole video; without it, all of them.
        instead: actors that stand in for the body, of the same frames, such as a robot's parts.

    Raises:
        InputError: the two motions differ in length.
    """
    count = len(human.root)
    if len(object_motion.T_world_object) != count:
        raise InputError(
            "frames-differ",
            f"The person has {count} frames, the object {len(object_motion.T_world_object)}.",
            fix="Give the two motions of one result.",
        )
    views = follow_motion(human, object_motion, width, height) if cameras is None else cameras
    actors = [*stage(human, object_motion, body, markers=markers, instead=instead), *extra]
    with open_renderer(width, height, backend, samples=samples) as renderer:
        ground = _ground(human, object_motion)
        renderer.show(Scene([ground, *(a.drawable for a in actors)], light=_key_light(views[0])))
        order = range(count) if only is None else only
        for frame, rgb in zip(order, play(renderer, actors, views, order), strict=True):
            seconds = object_motion.start_time + frame / FPS if time_code else None
            yield caption(rgb, label=label, seconds=seconds, pixels_per_metre=pixels_per_metre)


def stage(
    human: HumanMotion,
    object_motion: ObjectMotion,
    body: BodyModel,
    *,
    markers: bool = True,
    instead: Sequence[Actor] = (),
) -> list[Actor]:
    """The actors of a motion, without a floor: body, object and, if wanted, markers and trail.

    Actors `instead` of the body stand in for it; the person's palms are not marked then.
    """
    actors = [*(instead or [skinned_body(human, body)]), rigid_object(object_motion)]
    if markers and not instead:
        for k, side in enumerate(("left", "right")):
            palm, contact = human.joints[:, 22 + k], human.hand_contact[:, k]
            actors.append(contact_marker(f"{side} palm", palm, contact))
    if markers:
        actors.append(trail(object_corners(object_motion).mean(axis=1)))
    return actors


def skinned_body(
    human: HumanMotion, body: BodyModel, name: str = "body", color: Color = BODY_COLOR
) -> Actor:
    """The body's skin along the motion, computed a chunk of frames at a time."""
    vertices, faces = _lazy_skin(human, body), body.faces.numpy()
    closed = bool(trimesh.Trimesh(vertices(0), faces, process=False).is_watertight)
    return Actor(Drawable(name, vertices(0), faces, color, closed=closed), vertices=vertices)


def follow_motion(
    human: HumanMotion,
    object_motion: ObjectMotion,
    width: int,
    height: int,
    style: FollowStyle = FollowStyle(),
) -> list[Camera]:
    """The camera that follows a person and their object, one per frame."""
    return follow(
        subject(human, object_motion),
        human.root[:, :2],
        facing(human),
        object_corners(object_motion).mean(axis=1)[:, :2],
        width,
        height,
        style,
    )


def subject(
    human: HumanMotion, object_motion: ObjectMotion
) -> Float[np.ndarray, "frames points 3"]:
    """Return what a picture of the motion has to show: joints, crown and corners of the object, world."""
    crown = human.joints[:, joint("head"), None] + [0.0, 0.0, _CROWN]
    return np.concatenate([human.joints, crown, object_corners(object_motion)], axis=1)


def facing(human: HumanMotion) -> Float[np.ndarray, "frames 2"]:
    """Return the direction in which the person faces, world x y, of any length."""
    return human.rotations[:, joint("pelvis"), :2, 2]  # the body faces +z at rest


def object_corners(motion: ObjectMotion) -> Float[np.ndarray, "frames 8 3"]:
    """The corners of the object's own bounding box in the world; their mean is its middle."""
    low, high = motion.mesh.vertices.min(axis=0), motion.mesh.vertices.max(axis=0)
    corner = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(8, 3)
    T = motion.T_world_object
    return corner @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]


def _lazy_skin(
    human: HumanMotion, body: BodyModel
) -> Callable[[int], Float[np.ndarray, "verts 3"]]:
    root, rotations, fingers = (
        torch.as_tensor(np.ascontiguousarray(part), dtype=torch.float32)
        for part in (human.root, human.rotations, human.fingers)
    )
    kept: dict[int, Float[np.ndarray, "frames verts 3"]] = {}

    def vertices(frame: int) -> Float[np.ndarray, "verts 3"]:
        chunk = frame // _CHUNK
        if chunk not in kept:
            kept.clear()
            part = slice(chunk * _CHUNK, (chunk + 1) * _CHUNK)
            with torch.inference_mode():
                posed = full_kinematics(body, root[part], rotations[part], fingers[part])
                kept[chunk] = skin(body, *posed).numpy()
        return kept[chunk][frame % _CHUNK]

    return vertices


def _ground(human: HumanMotion, object_motion: ObjectMotion) -> Drawable:
    used = np.concatenate([human.joints, object_corners(object_motion)], axis=1)[..., :2]
    return floor(used.min(axis=(0, 1)), used.max(axis=(0, 1)))


def _key_light(camera: Camera) -> Light:
    """The sun over the shoulder of the first camera, to its left: shapes read, shadows show."""
    toward_camera = camera.T_world_camera[:3, 2]
    return Light(azimuth=float(np.arctan2(toward_camera[1], toward_camera[0])) - 0.9)


def held_places(segments: Sequence[ContactSegment], moved: ObjectMotion) -> list[Actor]:
    """One patch per hand that holds anything, on the surface where it is nearest to the palm.

    Args:
        segments: who holds where and when.
        moved: the object, with faces.
    """
    hands = sorted({segment.hand for segment in segments})
    if not hands:
        return []
    surface = sample_surface(moved.mesh)
    return [_patches([s for s in segments if s.hand == hand], moved, surface) for hand in hands]


def _patches(segments: Sequence[ContactSegment], moved: ObjectMotion, surface: Surface) -> Actor:
    """The patches of one hand: one that goes from place to place, and hides between them."""
    vertices, faces = ball(_PATCH_RADIUS)
    flat = vertices * [1.0, 1.0, _PATCH_THICKNESS / _PATCH_RADIUS]
    T_world_patch = moved.T_world_object.copy()
    visible = np.zeros(len(T_world_patch), bool)
    for segment in segments:
        span = slice(max(segment.start, 0), segment.stop)
        T_world_patch[span] = moved.T_world_object[span] @ _on_surface(segment.anchor, surface)
        visible[span] = True
    name = f"{('left', 'right')[segments[0].hand]} hold"
    drawable = Drawable(name, flat, faces, CONTACT_COLOR, casts_shadow=False)
    return Actor(drawable, T_world=T_world_patch, visible=visible)


def _on_surface(anchor: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "4 4"]:
    """Pose in the object's frame at the nearest point of the surface, z along its normal."""
    nearest = int(surface.tree.query(anchor)[1])
    z = surface.normals[nearest]
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = surface.points[nearest]
    return T
