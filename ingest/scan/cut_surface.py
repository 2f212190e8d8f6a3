"""An object's surface cut out of an app's mesh of a room, with its texture.

A room's atlas is mostly of other things. The object is unwrapped anew, and each pixel of its own atlas is
taken from where its place lies on the room's pictures.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import igl
import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int64, UInt8

from ingest.formats.camera_poses import opencv_poses
from ingest.mesh_texture import TexturedPart, fits, join_textures, patch, texture_colours
from ingest.report.take_report import Check, graded
from ingest.scan.clean_mesh import CleanMesh, object_frame
from ingest.scan.dense.stereo import at_pixels
from ingest.scan.mesh_sources import APP, room_file
from ingest.scan.region import GivenBox, find_aim
from ingest.scan.room_parts import (
    LARGEST,
    NO_PICTURE,
    RoomMesh,
    RoomSurface,
    find_room_floor,
    object_at,
    only_thing,
    read_room,
    read_room_of_session,
)
from ingest.scan.scan_sources import mesh_in
from ingest.scan.scan_types import ScanMesh, View
from ingest.scan.texture_atlas import SIDE, grown, texels, unwrap
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh, Texture

_LARGEST = 8192
"""Pixels along a side of a room's picture; larger ones are made smaller."""


@dataclass(frozen=True)
class Appearance:
    """What an object looks like."""

    colours: UInt8[np.ndarray, "verts 3"] | None
    texture: Texture | None


def look_of(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    looks: Float64[np.ndarray, "faces 3 6"],
    room: RoomMesh,
) -> tuple[Appearance, tuple[Check, ...]]:
    """Paint an object as its room is painted.

    Args:
        vertices, faces: metres.
        looks: of the corners, as in `RoomMesh`.
        room: whose pictures they are on.

    Returns:
        The look, and what is to be said of it.
    """
    used = np.unique(np.rint(looks[:, 0, 5])).astype(int)
    shown = [int(number) for number in used if number >= 0]
    unread: tuple[Check, ...] = ()
    if shown:
        try:
            if not fits([room.pictures[number] for number in shown]):
                raise ValueError("they are too large")
            texture = _repainted(vertices, faces, looks, room)
            colours = np.empty((len(vertices), 3), np.uint8)
            colours[faces] = texture_colours(texture)
            return Appearance(colours, texture), ()
        except (ValueError, OSError, SyntaxError) as error:  # what Pillow raises on damage
            unread = (_unread(room, error),)
    if not room.coloured:
        return Appearance(None, None), unread
    stated = np.empty((len(vertices), 3), np.uint8)
    stated[faces] = np.rint(looks[..., 2:5]).clip(0, 255).astype(np.uint8)
    return Appearance(stated, None), unread


def _unread(room: RoomMesh, error: Exception) -> Check:
    message = f"The pictures of {room.where.name} cannot be used, so it has no texture."
    return Check("texture", "warn", message, None, "Export it again, with smaller ones.")


def _repainted(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    looks: Float64[np.ndarray, "faces 3 6"],
    room: RoomMesh,
) -> Texture:
    uv = unwrap(vertices, faces, SIDE)
    number, weights = texels(uv, SIDE)
    rows, columns = np.nonzero(number >= 0)
    face, weight = number[rows, columns], weights[rows, columns]
    paint = np.einsum("nk,nkc->nc", weight, looks[face][..., 2:5])
    places = np.einsum("nk,nkc->nc", weight, looks[face][..., :2])
    picture = np.rint(looks[face, 0, 5]).astype(int)
    for index in np.unique(picture[picture >= 0]):
        mine = picture == index
        pixels = room.pictures[index].pixels(_LARGEST)
        height, width = pixels.shape[:2]
        u, v = (places[mine] % 1.0 * [width, height] - 0.5).T.astype(np.float32)
        inside = (u.clip(0, width - 1), v.clip(0, height - 1))
        paint[mine] = at_pixels(pixels, *inside, cv2.INTER_LINEAR)
    image = np.zeros((SIDE, SIDE, 3), np.uint8)
    image[rows, columns] = np.rint(paint).clip(0, 255).astype(np.uint8)
    return Texture(uv, grown(image, number >= 0))


_SAME = 1e-5
"""Metres between corners that are one vertex."""
_AROUND = 2 * LARGEST
"""Metres from a point within which the object is."""
_FLOATS_WARN, _FLOATS_BAD = 0.01, 0.1
"""Metres between the floor and the lowest part that is there."""
_PIECES = 3
"""More than so many say that something between them is missing."""
_FIX = "Make the mesh from the pictures (another ‹method›)."


@dataclass(frozen=True)
class _Standing:
    """The object's triangles in the floor's frame, and what was made up below the cut."""

    surface: RoomSurface
    looks: Float64[np.ndarray, "faces 3 6"]
    measured: Bool[np.ndarray, " verts"]


def cut_out(
    room: RoomMesh,
    name: str,
    *,
    at: Float64[np.ndarray, "3"] | None = None,
    box: GivenBox | None = None,
) -> CleanMesh:
    """Cut the object out of a room's mesh: what stands at a point, off its floor.

    The surface is the app's. Only what lies lower than the cut, some centimetres above the floor, is made
    up: it goes straight down, and is marked as not seen.

    Args:
        room: z up, metres.
        name: of the object.
        at: a point on the object, in the room; without, one thing alone must stand there.
        box: around the object and nothing else, where it touches other things.

    Raises:
        InputError: "scan-no-floor", "scan-no-object", "scan-several", "scan-nothing-there",
            "scan-joined", "scan-box".
    """
    near = _middle(box) if at is None and box is not None else at
    T_world_floor = find_room_floor(room.corners, near, str(room.where))
    if near is not None:
        away = np.linalg.norm(room.corners.mean(axis=1) - near, axis=1)
        room = room.only(np.flatnonzero(away < _AROUND))
    room = _in_floor(room if box is None else _within(room, box), T_world_floor)
    surface = _joined(room.corners)
    if at is None:
        at = only_thing(surface, T_world_floor, str(room.where))
    else:
        at = inverse(T_world_floor)[:3, :3] @ (at - T_world_floor[:3, 3])
    chosen, height = object_at(surface, at, str(room.where))
    above = _sliced(
        room.only(np.flatnonzero(chosen)), np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, height])
    )
    return _finished(_stood(above, height), above, T_world_floor, name, height)


def _middle(box: GivenBox) -> Float64[np.ndarray, "3"]:
    return (box.low + box.high) / 2


def _within(room: RoomMesh, box: GivenBox) -> RoomMesh:
    """What lies in a box of the world; its floor is not cut, which is told apart by itself."""
    for axis in range(3):
        for side, corner in ((1.0, box.low), (-1.0, box.high)):
            if axis == 2 and side > 0:
                continue
            room = _sliced(room, side * np.eye(3)[axis], corner)
    if len(room.corners) == 0:
        raise InputError(
            "scan-box",
            "There is nothing in the box.",
            where=str(room.where),
            fix="Give the lowest and the highest corner of a box around the object, in metres, z up.",
        )
    return room


def _in_floor(room: RoomMesh, T_world_floor: Float64[np.ndarray, "4 4"]) -> RoomMesh:
    return replace(room, corners=(room.corners - T_world_floor[:3, 3]) @ T_world_floor[:3, :3])


def _joined(corners: Float64[np.ndarray, "faces 3 3"]) -> RoomSurface:
    """Corners at one place become one vertex; the triangles keep their order."""
    places = np.rint(corners.reshape(-1, 3) / _SAME).astype(np.int64)
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    return RoomSurface(corners.reshape(-1, 3)[first], number.reshape(-1, 3).astype(np.int64))


def _sliced(
    room: RoomMesh, normal: Float64[np.ndarray, "3"], origin: Float64[np.ndarray, "3"]
) -> RoomMesh:
    """What lies on a plane's side to which its normal points, with its looks."""
    room = room.only(np.flatnonzero(trimesh.triangles.area(room.corners) > _SAME**2))
    ahead = (room.corners - origin) @ normal > 0
    across = ahead.any(axis=1) & ~ahead.all(axis=1)
    whole = room.only(np.flatnonzero(ahead.all(axis=1)))
    if not across.any():
        return whole
    count = int(across.sum())
    vertices, faces, looks = trimesh.intersections.slice_faces_plane(
        room.corners[across].reshape(-1, 3),
        np.arange(3 * count).reshape(-1, 3),
        normal,
        origin,
        uv=room.looks[across].reshape(-1, 6),
    )
    if len(faces) == 0:
        return whole
    assert looks is not None
    corners = np.concatenate([whole.corners, vertices[faces]])
    return replace(whole, corners=corners, looks=np.concatenate([whole.looks, looks[faces]]))


def _stood(above: RoomMesh, height: float) -> _Standing:
    """The object with its rim at the cut drawn straight down to the floor."""
    surface = _joined(above.corners)
    vertices, faces = surface.vertices, surface.faces
    whole = np.all(faces != np.roll(faces, 1, axis=1), axis=1)
    faces, looks = faces[whole], above.looks[whole]
    face, side = _rim(vertices, faces, height)
    a, b = faces[face, side], faces[face, (side + 1) % 3]
    ends, number = np.unique(np.concatenate([a, b]), return_inverse=True)
    low_a, low_b = np.split(len(vertices) + number.astype(np.int64), 2)
    below = vertices[ends] * [1.0, 1.0, 0.0]
    # Against the way in which the triangle above goes round.
    skirt = np.concatenate([np.stack([b, a, low_a], axis=1), np.stack([b, low_a, low_b], axis=1)])
    look_a, look_b = looks[face, side], looks[face, (side + 1) % 3]
    painted = np.concatenate(
        [np.stack([look_b, look_a, look_a], axis=1), np.stack([look_b, look_a, look_b], axis=1)]
    )
    return _Standing(
        RoomSurface(np.concatenate([vertices, below]), np.concatenate([faces, skirt])),
        np.concatenate([looks, painted]),
        np.arange(len(vertices) + len(below)) < len(vertices),
    )


def _rim(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"], height: float
) -> tuple[Int64[np.ndarray, " edges"], Int64[np.ndarray, " edges"]]:
    """Triangles with an open edge at the cut, and which of their edges it is."""
    low = np.abs(vertices[:, 2] - height) < 2 * _SAME
    ways = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    key = ways[:, 0] * len(vertices) + ways[:, 1]
    back = ways[:, 1] * len(vertices) + ways[:, 0]
    rim = np.flatnonzero(low[ways].all(axis=1) & ~np.isin(back, key))
    return rim // 3, rim % 3


def _finished(
    standing: _Standing,
    room: RoomMesh,
    T_world_floor: Float64[np.ndarray, "4 4"],
    name: str,
    height: float,
) -> CleanMesh:
    """The object in its own frame, with its texture and what is to be said of it."""
    vertices, faces = standing.surface.vertices, standing.surface.faces
    floats = float(vertices[:, 2].min())
    world = vertices @ T_world_floor[:3, :3].T + T_world_floor[:3, 3]
    T = object_frame(world, T_world_floor)
    own = (world - T[:3, 3]) @ T[:3, :3]
    look, unread = look_of(own, faces, standing.looks, room)
    rims = len(igl.boundary_loop_all(faces))
    notes = (
        *room.notes,
        _told(room, height),
        _reaches_down(floats),
        _whole(faces),
        *unread,
        _holes(rims),
    )
    return CleanMesh(
        mesh=ScanMesh(own, faces, look.colours, name, notes, look.texture),
        normals=np.asarray(igl.per_vertex_normals(own, faces), np.float64),
        T_world_object=T,
        seen=standing.measured,
        watertight=rims == 0,
    )


def _told(room: RoomMesh, height: float) -> Check:
    message = (
        f"It was cut out of {room.where.name}, {100 * height:.1f} cm above the floor; below, it goes "
        "straight down. All else is the app's surface as it is: nothing was measured anew."
    )
    return Check("cut out", "ok", message)


def _reaches_down(floats: float) -> Check:
    severity = "bad" if floats > _FLOATS_BAD else "warn" if floats > _FLOATS_WARN else "ok"
    message = f"Its lowest part lies {100 * max(floats, 0.0):.1f} cm above the floor."
    if severity != "ok":
        message += (
            " What it stands on is missing in the app's mesh, as thin legs often are, and a motion "
            "would stand that much too low."
        )
    return graded("base", severity, message, _FIX)


def _whole(faces: Int64[np.ndarray, "faces 3"]) -> Check:
    """Whether the object is in one piece, as its vertices say."""
    count = len(np.unique(igl.facet_components(faces)[1]))
    message = f"It is in {count} {'piece' if count == 1 else 'pieces that do not meet'}."
    if count > _PIECES:
        message += " Thin parts between them are missing in the app's mesh."
    return graded("pieces", "warn" if count > _PIECES else "ok", message, _FIX)


def _holes(rims: int) -> Check:
    if rims == 0:
        return Check("closed", "ok", "The surface is closed.")
    message = (
        f"The surface has {rims} holes, as the app left it; a motion can be made all the same."
    )
    return Check("closed", "ok", message)


def read_room_in(source: Path) -> RoomMesh:
    """The room's mesh that was given, or that lies in a session.

    Raises:
        InputError: "scan-mesh-missing", or those of `read_parts`.
    """
    mesh = mesh_in(source)
    if mesh is not None:
        return read_room(mesh)
    return read_room_of_session(room_file(APP, source))


def room_view(source: Path) -> ObjectMesh:
    """The room as one surface in its own axes (z up, metres), with its pictures made small.

    Raises:
        InputError: those of `read_room_in`.
    """
    room = read_room_in(source)
    painted = room.looks[:, 0, 5]
    room = room.only(np.argsort(painted, kind="stable"))
    mesh = room.surface
    mesh.merge_vertices()
    return ObjectMesh(
        np.asarray(mesh.vertices, np.float64),
        np.asarray(mesh.faces, np.int64),
        room.where.stem,
        _texture(room),
    )


def _texture(room: RoomMesh) -> Texture | None:
    """One small picture of all; None where there is none, or none that can be shown."""
    if not room.pictures or not fits(list(room.pictures)):
        return None
    number = room.looks[:, 0, 5]
    try:
        parts = [
            TexturedPart(
                room.corners[number == k],
                room.looks[number == k][..., :2],
                patch() if k == NO_PICTURE else room.pictures[k].pixels(),
            )
            for k in map(int, np.unique(number))
        ]
    except (ValueError, OSError, SyntaxError):  # what Pillow raises on a damaged picture
        return None
    return join_textures(parts)


_MOST = 200
"""Poses of a session that are looked at."""


def place_looked_at(session: CaptureSession) -> Float64[np.ndarray, "3"] | None:
    """The point that the camera was held towards, in the phone's world (z up, metres).

    Returns:
        None where it was not held towards one place.
    """
    ok = session.tracking_ok
    T_world_phone = session.T_world_phone if ok is None else session.T_world_phone[ok]
    poses = opencv_poses(T_world_phone[:: max(1, len(T_world_phone) // _MOST)])
    views = [View(str(k), Path(), (1, 1), np.ones(4), pose) for k, pose in enumerate(poses)]
    try:
        return find_aim(views).point
    except InputError:
        return None
