"""read_scan_mesh: a mesh that another app made of the object, in metres, z up, with its colours."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64, UInt8
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ingest.mesh import MAX_EXTENT, MIN_EXTENT
from ingest.mesh_texture import TexturedPart, join_textures, patch, texture_colours
from ingest.report.check import Check
from ingest.scan.choices import Unit, Up
from ingest.scan.sources.mesh_parts import FilePart, fits, read_parts
from ingest.scan.types import ScanMesh
from omomo_core.errors import InputError
from omomo_core.motion import Texture

_APART = 0.02
"""Gap between the boxes of two parts, in sizes of the whole, that makes them two objects."""
_CRUMB = 0.02
"""Part of the largest object's faces that another one has at least."""

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
NAMES: dict[Unit, str] = {
    "m": "metres", "cm": "centimetres", "mm": "millimetres", "in": "inches", "ft": "feet"
}  # fmt: skip
_PLAUSIBLE = (0.1, 2.5)
"""Metres of the largest side of what people carry, drag or sweep with."""
_USUAL = 0.8
"""Metres; of two plausible units, that which makes the largest side more like this is taken."""


def read_scan_mesh(
    path: Path,
    *,
    name: str | None = None,
    unit: Unit | None = None,
    height: float | None = None,
    up: Up | None = None,
) -> ScanMesh:
    """Read a ready mesh.

    glTF and most USD are y up and turned; other formats state no up axis and stay as they are.

    Args:
        path: GLB, glTF, OBJ, PLY, STL or USD(Z).
        name: of the object in the file, where there are several.
        unit: of the file, where it is known; otherwise what the file says, or guessed.
        height: true extent along z, metres; goes before any unit.
        up: the axis of the file that is up; otherwise what the file says, or z.

    Raises:
        InputError: "mesh-objects", "mesh-object-unknown", "mesh-units", or those of `read_parts`.
    """
    file = read_parts(path, up)
    chosen = _chosen(file.parts, name, path)
    vertices = np.concatenate([part.vertices for part in chosen])
    first = np.cumsum([0, *(len(part.vertices) for part in chosen[:-1])])
    faces = np.concatenate([p.faces + at for p, at in zip(chosen, first, strict=True)])
    metres, notes = _metres(np.ptp(vertices, axis=0), unit, file.metres, height, path)
    texture, unread = _texture(chosen, path)
    colours = _colours(chosen, faces, texture)
    return ScanMesh(vertices * metres, faces, colours, path.stem, (*notes, *unread), texture)


def _chosen(parts: Mapping[str, FilePart], name: str | None, path: Path) -> list[FilePart]:
    """The parts of the one object; meshes that touch are one object in several pieces."""
    names = list(parts)
    if name is not None:
        picked = [key for key in names if name in (key, key.rsplit("/", 1)[-1])]
        picked = picked or [key for key in names if f"/{name}/" in key]
        if not picked:
            raise InputError(
                "mesh-object-unknown",
                f"{path.name} holds nothing called {name!r}.",
                where=str(path),
                fix=f"Give one of {', '.join(names[:12])}.",
            )
        return [parts[key] for key in picked]
    boxes = [(part.vertices.min(axis=0), part.vertices.max(axis=0)) for part in parts.values()]
    label = _together(np.array(boxes))
    faces = np.bincount(label, [len(parts[key].faces) for key in names])
    objects = np.flatnonzero(faces >= _CRUMB * faces.max())
    if len(objects) > 1:
        size = np.array([np.linalg.norm(high - low) for low, high in boxes])
        largest = [names[int(np.where(label == one, size, 0).argmax())] for one in objects]
        raise InputError(
            "mesh-objects",
            f"{path.name} holds {len(objects)} objects that stand apart: {', '.join(largest[:8])}.",
            where=str(path),
            fix="Say which one is meant (--object-name), or export it alone.",
        )
    return [parts[key] for key, one in zip(names, label, strict=True) if one == objects[0]]


def _together(bounds: Float64[np.ndarray, "parts 2 3"]) -> np.ndarray:
    """Parts whose bounding boxes touch get the same number."""
    low, high = bounds[:, 0], bounds[:, 1]
    reach = _APART * np.linalg.norm(high.max(axis=0) - low.min(axis=0))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=-1)
    return connected_components(coo_array(gap <= reach), directed=False)[1]


def _metres(
    extents: Float64[np.ndarray, "3"],
    unit: Unit | None,
    stated: float | None,
    height: float | None,
    path: Path,
) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of the file."""
    if height is not None:
        if not 0 < height < 10 or extents[2] <= 0:
            raise InputError(
                "mesh-units",
                f"An object is not {height:g} m high.",
                where=str(path),
                fix="Give its height in metres.",
            )
        return height / float(extents[2]), ()
    if unit is not None:
        return METRES[unit], ()
    metres, notes = _guess_unit(extents * (stated or 1.0), str(path))
    return metres * (stated or 1.0), notes


def _texture(parts: list[FilePart], path: Path) -> tuple[Texture | None, tuple[Check, ...]]:
    """The pictures of the parts joined to one, and what is to be told where that cannot be."""
    pictures = {id(part.picture.image): part.picture for part in parts if part.picture is not None}
    if not pictures:
        return None, ()
    try:
        if not fits(list(pictures.values())):
            raise ValueError("they are too large")
        pixels = {key: picture.pixels() for key, picture in pictures.items()}
        grey = patch()
        painted = [
            TexturedPart(
                part.vertices[part.faces],
                part.uv,
                grey if part.picture is None else pixels[id(part.picture.image)],
            )
            for part in parts
        ]
        return join_textures(painted), ()
    except (ValueError, OSError, SyntaxError) as error:  # what Pillow raises on a damaged picture
        message = f"The pictures of {path.name} cannot be used ({error}), so it has no texture."
        return None, (
            Check("texture", "warn", message, None, "Export it again, with smaller ones."),
        )


def _colours(
    parts: list[FilePart], faces: Int64[np.ndarray, "faces 3"], texture: Texture | None
) -> UInt8[np.ndarray, "vertices 3"] | None:
    """Colours of the vertices, as the file states them or as the texture has them."""
    if texture is None and all(part.colours is None for part in parts):
        return None
    white = [np.full((len(part.vertices), 3), 255, np.uint8) for part in parts]
    own = [plain if p.colours is None else p.colours for p, plain in zip(parts, white, strict=True)]
    colours = np.concatenate(own)
    if texture is not None:
        stated = np.concatenate([np.full(len(p.faces), p.colours is not None) for p in parts])
        colours[faces[~stated]] = texture_colours(texture)[~stated]
    return colours


def _guess_unit(extents: Float64[np.ndarray, "3"], where: str) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of a mesh that states none, and what to tell about it.

    Args:
        extents: sides of its bounding box in its own unit.
        where: its file, for messages.

    Raises:
        InputError: "mesh-units" when no unit makes it a thing that a person moves.
    """
    largest = float(extents.max())
    if MIN_EXTENT <= largest <= MAX_EXTENT:
        return 1.0, ()
    sides = " x ".join(f"{side:.4g}" for side in extents)
    likely: list[Unit] = [
        unit
        for unit in ("cm", "mm", "in")
        if _PLAUSIBLE[0] <= largest * METRES[unit] <= _PLAUSIBLE[1]
    ]
    likely.sort(key=lambda unit: abs(np.log(largest * METRES[unit] / _USUAL)))
    if not likely:
        raise InputError(
            "mesh-units",
            f"The mesh measures {sides}; in no unit is that a thing that a person moves.",
            where=where,
            fix="Say its unit (--units), or the true height of the object (--height).",
        )
    best, others = likely[0], likely[1:]
    alternatives = "; ".join(
        f"in {NAMES[u]} it would be {largest * METRES[u]:.2f} m" for u in others
    )
    message = (
        f"The mesh measures {sides} and does not say in what; taken for {NAMES[best]}, so that its "
        f"largest side is {largest * METRES[best]:.2f} m"
    )
    message += f" ({alternatives})." if alternatives else "."
    fix = "Measure the object; if that is wrong, say its unit (--units) or its height (--height)."
    return METRES[best], (Check("units", "warn", message, None, fix),)
