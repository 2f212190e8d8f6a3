"""What a mesh file holds: parts with their looks, remarks on how they were read, and what bounds them."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64, UInt8

from ingest.mesh_texture import BaseColour, TexturedPart, fits, join_textures, patch
from omomo_core.errors import DamageError, InputError, reading
from omomo_core.motion import Texture

MAX_BYTES = 200 * 10**6
MAX_FACES = 2_000_000


@dataclass(frozen=True)
class FilePart:
    """A mesh of a file, or the part of one that has its own material."""

    name: str
    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int64[np.ndarray, "faces 3"]
    colours: UInt8[np.ndarray, "verts 3"] | None = None
    """sRGB, without the picture; None where the file states none."""
    places: Float64[np.ndarray, "faces 3 2"] | None = None
    """Places of the corners on the picture: (0, 0) is its top left corner."""
    picture: BaseColour | None = None

    @property
    def uv(self) -> Float64[np.ndarray, "faces 3 2"]:
        """Places of the corners on the picture; its middle where they have none."""
        return np.full((*self.faces.shape, 2), 0.5) if self.places is None else self.places

    def moved(self, T: Float64[np.ndarray, "4 4"]) -> "FilePart":
        """The part in other axes; a mirror turns its triangles, so that its outside stays outside."""
        vertices = self.vertices @ T[:3, :3].T + T[:3, 3]
        if np.linalg.det(T[:3, :3]) >= 0:
            return replace(self, vertices=vertices)
        places = None if self.places is None else self.places[:, ::-1]
        return replace(self, vertices=vertices, faces=self.faces[:, ::-1], places=places)


@dataclass(frozen=True)
class ReadMesh:
    """All that is drawn of a file, in its own frame and unit."""

    parts: tuple[FilePart, ...]
    notes: tuple[str, ...] = ()
    """What was done to read it, or left out, in words for the user."""

    @property
    def triangles(self) -> int:
        """How many there are in all parts."""
        return sum(len(part.faces) for part in self.parts)


def joined_parts(
    parts: Sequence[FilePart],
) -> tuple[Float64[np.ndarray, "verts 3"], Int64[np.ndarray, "faces 3"]]:
    """Vertices and triangles of all parts, in their order."""
    if not parts:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    first = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [part.faces + at for part, at in zip(parts, first, strict=True)]
    return np.concatenate([part.vertices for part in parts]), np.concatenate(faces)


def joined_picture(parts: Sequence[FilePart]) -> Texture | None:
    """The pictures of all parts as one texture; None where no part has one.

    Raises:
        ValueError, OSError, SyntaxError: a picture is damaged, or they are too large together.
    """
    pictures = {id(part.picture.image): part.picture for part in parts if part.picture is not None}
    if not pictures:
        return None
    if not fits(list(pictures.values())):
        raise DamageError("they are too large")
    tinted = {id(part.picture): part.picture for part in parts if part.picture is not None}
    pixels = {key: picture.pixels() for key, picture in tinted.items()}
    plain = {id(part): _plain(part) for part in parts if part.picture is None}
    return join_textures(
        [
            TexturedPart(
                part.vertices[part.faces],
                part.uv,
                plain[id(part)] if part.picture is None else pixels[id(part.picture)],
            )
            for part in parts
        ]
    )


def _plain(part: FilePart) -> UInt8[np.ndarray, "h w 3"]:
    """A patch in the mean colour of a part without a picture."""
    if part.colours is None or len(part.colours) == 0:
        return patch()
    return patch(np.rint(part.colours.mean(axis=0)))


def constant_colour(colour: Sequence[float] | np.ndarray, count: int) -> UInt8[np.ndarray, "n 3"]:
    """One colour, 0 to 255, for so many vertices."""
    one = np.rint(np.asarray(colour, np.float64)[:3].clip(0, 255)).astype(np.uint8)
    return np.tile(one, (count, 1))


def only_used(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> tuple[Int64[np.ndarray, " used"], Int64[np.ndarray, "faces 3"]]:
    """Numbers of the vertices that triangles name, in their order, and the triangles of those.

    Raises:
        ValueError: a triangle names a vertex that is not there.
    """
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise DamageError("a triangle names a vertex that is not there")
    used = np.zeros(len(vertices), np.bool_)
    used[faces] = True
    number = np.cumsum(used) - 1
    return np.flatnonzero(used).astype(np.int64), number[faces].astype(np.int64)


def too_large(path: Path, size: str) -> InputError:
    """The error for a mesh file of such a size, "mesh-too-large"."""
    return InputError(
        "mesh-too-large",
        f"{path.name} has {size}; at most {MAX_BYTES / 1e6:.0f} MB and {MAX_FACES:,} triangles "
        "are read.",
        where=str(path),
        fix="Simplify the mesh: 20,000 triangles are plenty for a motion.",
    )


def cut_short(path: Path, how: str) -> InputError:
    """The error for a file that surely lacks its end, "mesh-truncated"."""
    return InputError(
        "mesh-truncated",
        f"{path.name} is cut short: {how}.",
        where=str(path),
        fix="Copy the file again, or export the mesh again.",
    )


def unreadable(path: Path, why: str, code: str = "mesh-unreadable") -> InputError:
    """The error for a damaged file of a 3D program."""
    return InputError(
        code,
        f"{path.name} cannot be read: {why}.",
        where=str(path),
        fix="Open it in a 3D program and export it again.",
    )


def decoding(path: Path, code: str = "mesh-unreadable") -> AbstractContextManager[None]:
    """Turn whatever a decoder raises on such a file into one error.

    Raises:
        InputError: of this code, or what the block raises itself.
    """
    return reading(lambda why: unreadable(path, why, code))
