"""look_of: the colours of an object that was cut out of a room, and an atlas of its own.

A room's atlas is mostly of other things. The object is unwrapped anew, and each pixel of its own atlas is
taken from where its place lies on the room's pictures.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, Int64, UInt8

from ingest.mesh_texture import texture_colours
from ingest.report.check import Check
from ingest.scan.cutting.room import RoomMesh
from ingest.scan.dense.picture import at_pixels
from ingest.scan.sources.mesh_parts import fits
from ingest.scan.texture.atlas import SIDE, grown, texels, unwrap
from omomo_core.motion import Texture

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
    message = f"The pictures of {room.where.name} cannot be used ({error}), so it has no texture."
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
