"""Pictures of a mount: the object with the phone where it was found to be, by itself and in a take."""

from collections.abc import Mapping

import numpy as np
import trimesh
from jaxtyping import Float, UInt8

from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh, ObjectMotion
from render.backends import Backend, open_renderer
from render.cameras import orbit, pinhole
from render.lettering import caption
from render.props import floor, solid
from render.scene import Drawable, Scene, split_mesh
from render.video import contact_sheet

_PHONE, _LENS, _SIGHT = (0.16, 0.17, 0.20), (0.20, 0.55, 0.90), (0.25, 0.60, 0.92)
_VIEWS = {"from its front": (0.5, 0.25), "from its side": (1.15, 0.2), "from above": (0.5, 1.2)}
"""Azimuth from where the phone is, and elevation, radians."""
_FOV, _MARGIN = 0.55, 1.15
_SIGHT_LENGTH = 0.16
"""Metres of the lines that show what the camera looks at."""
_HALF_IMAGE = np.array([0.66, 0.49])
"""Half the image of an iPhone's wide camera at one metre, landscape."""


def mount_picture(
    mesh: ObjectMesh,
    T_phone_object: Float[np.ndarray, "4 4"],
    T_phone_body: Float[np.ndarray, "4 4"],
    body: tuple[float, float, float],
    *,
    label: str = "",
    side: int = 420,
    backend: Backend = "auto",
) -> UInt8[np.ndarray, "h w 3"]:
    """Three views side by side; the blue lines are what the phone's camera sees.

    Args:
        mesh: the object in its own frame.
        T_phone_object: the mount.
        T_phone_body: the phone's body (origin in the middle of its front glass) in the camera's frame.
        body: its width, height and thickness, metres.
        label: in the corner of the first view.
        side: of each view, pixels.
        backend: see `open_renderer`.
    """
    T_object_phone = inverse(T_phone_object)
    things = [
        solid(mesh),
        *_phone(T_object_phone, T_object_phone @ T_phone_body, body),
    ]
    points = np.concatenate([thing.vertices for thing in things])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, radius = (low + high) / 2, _MARGIN * float(np.linalg.norm(high - low)) / 2
    phone = T_object_phone[:2, 3] - middle[:2]
    towards = np.arctan2(phone[1], phone[0])
    pictures: list[UInt8[np.ndarray, "h w 3"]] = []
    with open_renderer(side, side, backend) as renderer:
        renderer.show(Scene(things))
        for name, (azimuth, elevation) in _VIEWS.items():
            T = orbit(middle, radius / np.sin(_FOV / 2), towards + azimuth, elevation)
            rgb, _ = renderer.draw(pinhole(T, _FOV, side, side))
            pictures.append(caption(rgb, label=label if label and not pictures else name))
    return contact_sheet(pictures, len(pictures))


_PATH_COLOR = (0.25, 0.45, 0.75)
_BEAD, _BEADS = 0.012, 60
"""Metres of radius, and number, of the beads that show the way of the object over the floor."""
_LOOK_DOWN = 0.35
"""Elevation of the camera over the take, radians."""


def take_picture(
    motion: ObjectMotion,
    moments: Mapping[str, int],
    T_phone_object: Float[np.ndarray, "4 4"],
    T_phone_body: Float[np.ndarray, "4 4"],
    body: tuple[float, float, float],
    *,
    side: int = 420,
    backend: Backend = "auto",
) -> UInt8[np.ndarray, "h w 3"]:
    """The object with the phone on it, on its floor and on its way, at a few moments side by side.

    Args:
        motion: of the object, z up, floor at 0.
        moments: frames by the words that are written on them.
        T_phone_object: the mount.
        T_phone_body, body: the phone, as for `mount_picture`.
        side: of each view, pixels.
        backend: see `open_renderer`.
    """
    T_object_phone = inverse(T_phone_object)
    things = [solid(motion.mesh), *_phone(T_object_phone, T_object_phone @ T_phone_body, body)]
    points = np.concatenate([thing.vertices for thing in things])
    way = motion.T_world_object[motion.valid][:, :2, 3]
    beads = [_bead(k, place) for k, place in enumerate(way[:: max(1, len(way) // _BEADS)])]
    ground = floor(way.min(axis=0), way.max(axis=0))
    pictures: list[UInt8[np.ndarray, "h w 3"]] = []
    with open_renderer(side, side, backend) as renderer:
        renderer.show(Scene([*things, *beads, ground]))
        for words, frame in moments.items():
            T = motion.T_world_object[frame]
            for thing in things:
                renderer.update(thing.name, T_world=T)
            at = points @ T[:3, :3].T + T[:3, 3]
            low, high = at.min(axis=0), at.max(axis=0)
            low[2] = min(low[2], 0.0)
            radius = _MARGIN * float(np.linalg.norm(high - low)) / 2
            phone = (T @ T_object_phone)[:2, 3] - T[:2, 3]
            azimuth = np.arctan2(phone[1], phone[0]) + _VIEWS["from its front"][0]
            camera = orbit((low + high) / 2, radius / np.sin(_FOV / 2), azimuth, _LOOK_DOWN)
            rgb, _ = renderer.draw(pinhole(camera, _FOV, side, side))
            pictures.append(caption(rgb, label=words))
    return contact_sheet(pictures, len(pictures))


def _bead(number: int, place: Float[np.ndarray, "2"]) -> Drawable:
    ball = trimesh.creation.icosphere(1, _BEAD)
    ball.apply_translation([*place, _BEAD])
    part = split_mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    return Drawable(f"way {number}", part.vertices, part.faces, _PATH_COLOR, casts_shadow=False)


def _phone(
    T_object_phone: Float[np.ndarray, "4 4"],
    T_object_body: Float[np.ndarray, "4 4"],
    body: tuple[float, float, float],
) -> list[Drawable]:
    """The body, the lens and the edges of what it sees, in the object's frame."""
    slab = trimesh.creation.box(body)
    slab.apply_translation([0, 0, -body[2] / 2])
    slab.apply_transform(T_object_body)
    lens = trimesh.creation.icosphere(2, 0.007)
    lens.apply_transform(T_object_phone)
    x, y = _SIGHT_LENGTH * _HALF_IMAGE
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    corners[:, 2] = -_SIGHT_LENGTH
    ends = [(np.zeros(3), corner) for corner in corners]
    ends += [(corners[k - 1], corners[k]) for k in range(4)]
    parts = [("phone", slab, _PHONE), ("lens", lens, _LENS)]
    for k, end in enumerate(ends):
        edge = trimesh.creation.cylinder(0.0015, segment=np.stack(end), sections=6)
        edge.apply_transform(T_object_phone)
        parts.append((f"sight {k}", edge, _SIGHT))
    shown = [
        (name, split_mesh(np.asarray(part.vertices), np.asarray(part.faces)), color)
        for name, part, color in parts
    ]
    return [Drawable(name, part.vertices, part.faces, color) for name, part, color in shown]
