"""room_view: a room as somebody is to see it who points at the object in it."""

from pathlib import Path

import numpy as np

from ingest.mesh_texture import TexturedPart, join_textures, patch
from ingest.scan.cutting.room import NO_PICTURE, RoomMesh, read_room, read_room_of_session
from ingest.scan.sources.mesh_parts import fits
from ingest.scan.sources.read import mesh_in
from ingest.scan.sources.room_mesh import APP, room_file
from omomo_core.motion import ObjectMesh, Texture


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
