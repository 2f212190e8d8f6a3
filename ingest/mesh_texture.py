"""read_texture: the picture on the surface of an OBJ, GLB or glTF file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float, Int, UInt8
from PIL import Image
from scipy.spatial import KDTree

from omomo_core.motion import Texture

_FORMATS = (".obj", ".glb", ".gltf")
MOST_PIXELS = 8192 * 8192
"""Most pixels of the pictures of a file together: phone apps paint no larger ones."""
MOST_SIDE = 2048
"""Larger pictures are made smaller: an object fills a part of a screen."""
_SAME = 1e-5
"""Corners so close, by the object's extent, are one."""
_UNKNOWN = 0.02
"""Share of triangles whose place on the picture may be unknown."""
_PATCH = 8
"""Pixels along each side of a patch of one colour, for a part without a picture."""
_GREY = (178, 178, 178)

Pixels = UInt8[np.ndarray, "h w 3"]
Paint = tuple[Float[np.ndarray, "faces 3 2"] | None, Pixels | None]
"""Places of triangles' corners on a picture, and the picture; None where there is none."""


@dataclass(frozen=True)
class TexturedPart:
    """Triangles that have one material, wherever they stand."""

    corners: Float[np.ndarray, "faces 3 3"]
    uv: Float[np.ndarray, "faces 3 2"]
    """(0, 0) is the picture's top left corner."""
    image: Pixels


@dataclass(frozen=True)
class BaseColour:
    """The base colour of a material, decoded when it is asked for."""

    image: Image.Image
    factor: Any = None
    """What its linear values are multiplied with, 0 to 255; None leaves them."""

    def pixels(self, side: int = MOST_SIDE) -> Pixels:
        """The picture, made smaller where a side is longer than so many pixels.

        Raises:
            ValueError: it has more than MOST_PIXELS.
            OSError, SyntaxError: it is damaged.
        """
        return _tinted(pixels_of(self.image, side), self.factor)


def read_texture(path: Path, corners: Float[np.ndarray, "faces 3 3"]) -> Texture | None:
    """Return the texture of a mesh file, the pictures of several materials joined to one.

    Args:
        path: the mesh file; pictures beside it are read.
        corners: of the triangles as they were read, in the file's frame and unit.

    Returns:
        None where the file has no picture, or one that cannot be read: it shapes no motion.
    """
    if path.suffix.lower() not in _FORMATS:
        return None
    try:
        scene = trimesh.load_scene(path, process=False)
        if not _has_pictures(scene):
            return None
        parts = list(_parts(scene))
        joined = join_textures(parts)
        placed = _matched(corners, np.concatenate([part.corners for part in parts]), joined.uv)
    except Exception:  # the decoders raise anything on a damaged file
        return None
    return None if placed is None else Texture(placed, joined.image)


def _has_pictures(scene: trimesh.Scene) -> bool:
    pictures = [picture_of(part) for part in scene.geometry.values()]
    sizes = [picture.image.size for picture in pictures if picture is not None]
    return bool(sizes) and sum(width * height for width, height in sizes) <= MOST_PIXELS


def _parts(scene: trimesh.Scene) -> Iterator[TexturedPart]:
    """Every copy of every mesh of a scene, where it stands."""
    pixels = {name: _pixels(mesh) for name, mesh in scene.geometry.items()}
    for node in scene.graph.nodes_geometry:
        T, name = scene.graph[node]
        mesh: Any = scene.geometry[name]
        faces = np.asarray(mesh.faces)
        corners = trimesh.transform_points(mesh.vertices, T)[faces]
        yield TexturedPart(corners, places_of(mesh), pixels[name])


def picture_of(mesh: Any) -> BaseColour | None:
    """The base colour picture of trimesh's mesh, where its vertices have places on it."""
    visual = mesh.visual
    if visual.kind != "texture" or visual.uv is None:
        return None
    material = visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    return None if image is None else BaseColour(image, getattr(material, "baseColorFactor", None))


def places_of(mesh: Any) -> Float[np.ndarray, "faces 3 2"]:
    """Return texture coordinates of the corners of trimesh's triangles; the middle without any."""
    faces = np.asarray(mesh.faces)
    if picture_of(mesh) is None:
        return np.full((*faces.shape, 2), 0.5)
    # trimesh counts from the bottom left.
    return np.asarray(mesh.visual.uv, float)[faces] * [1.0, -1.0] + [0.0, 1.0]


def _pixels(mesh: Any) -> Pixels:
    picture, material = picture_of(mesh), getattr(mesh.visual, "material", None)
    if picture is None:
        return patch(_GREY if material is None else np.asarray(material.main_color)[:3])
    return picture.pixels()


def patch(colour: Sequence[int] | np.ndarray = _GREY) -> Pixels:
    """A small picture of one colour, for a part without a picture."""
    return np.tile(np.asarray(colour, np.uint8), (_PATCH, _PATCH, 1))


def pixels_of(image: Image.Image, side: int = MOST_SIDE) -> Pixels:
    """The pixels of a picture, which is made smaller if a side is longer than so many.

    Raises:
        ValueError: it has more than MOST_PIXELS.
    """
    if image.width * image.height > MOST_PIXELS:
        raise ValueError("the picture is too large")
    shown = image.convert("RGB")
    shown.thumbnail((side, side))
    return np.asarray(shown, np.uint8)


def _tinted(pixels: Pixels, factor: Any) -> Pixels:
    """glTF multiplies the linear values of the picture with this factor, 0 to 255 here."""
    if factor is None:
        return pixels
    s = np.arange(256) / 255.0
    linear = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)
    value = linear[:, None] * np.asarray(factor, float)[:3] / 255.0
    back = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    table = np.rint(255.0 * back).astype(np.uint8)
    return np.stack([table[:, k][pixels[..., k]] for k in range(3)], axis=-1)


def texture_colours(texture: Texture) -> UInt8[np.ndarray, "faces 3 3"]:
    """The colours of a texture at the corners of its triangles."""
    height, width = texture.image.shape[:2]
    places = (texture.uv % 1.0 * [width, height]).astype(np.int64)
    return texture.image[places[..., 1], places[..., 0]]


def join_textures(parts: Sequence[TexturedPart]) -> Texture:
    """One texture of all parts, their triangles in order: the pictures below each other."""
    images = list({id(part.image): part.image for part in parts}.values())
    if len(images) == 1:
        return Texture(np.concatenate([part.uv for part in parts]), images[0])
    shrink = min(1.0, 2 * MOST_SIDE / sum(len(image) for image in images))
    rows = [max(2, round(len(image) * shrink)) for image in images]
    width = max(max(2, round(image.shape[1] * shrink)) for image in images)
    scaled = [
        np.asarray(Image.fromarray(image).resize((width, height)))
        for image, height in zip(images, rows, strict=True)
    ]
    top = dict(zip(map(id, images), np.cumsum([0, *rows[:-1]]).tolist(), strict=True))
    height = {id(image): count for image, count in zip(images, rows, strict=True)}
    uv = [_moved(part.uv, top[id(part.image)], height[id(part.image)], sum(rows)) for part in parts]
    return Texture(np.concatenate(uv), np.concatenate(scaled))


def _moved(
    uv: Float[np.ndarray, "faces 3 2"], top: int, height: int, total: int
) -> Float[np.ndarray, "faces 3 2"]:
    """Places on one picture of several: one that repeats does so no more, so wrap each triangle."""
    once = uv - np.floor(uv.min(axis=1, keepdims=True) + 1e-6)
    edge = 0.5 / height  # half a pixel, so that no neighbour shines through
    v = np.clip(once[..., 1], edge, 1.0 - edge)
    return np.stack([once[..., 0], (top + v * height) / total], axis=-1)


def _matched(
    wanted: Float[np.ndarray, "faces 3 3"],
    there: Float[np.ndarray, "others 3 3"],
    uv: Float[np.ndarray, "others 3 2"],
) -> Float[np.ndarray, "faces 3 2"] | None:
    """Places of triangles on the picture, found by where they are: readers order them differently."""
    extent = float(np.ptp(wanted.reshape(-1, 3), axis=0).max())
    found: Any = KDTree(_signature(there, extent)).query(_signature(wanted, extent))
    far, face = found
    if np.mean(far > _SAME * extent) > _UNKNOWN:
        return None
    apart = np.linalg.norm(wanted[:, :, None] - there[face][:, None], axis=-1)
    corner: Int[np.ndarray, "faces 3"] = apart.argmin(axis=2)
    return uv[face[:, None], corner]


def _signature(
    corners: Float[np.ndarray, "faces 3 3"], extent: float
) -> Float[np.ndarray, "faces 6"]:
    """The middle of each triangle and the side it shows: two may lie back to back."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    normal = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    return np.concatenate([corners.mean(axis=1), normal * extent * 1e-3], axis=1)
