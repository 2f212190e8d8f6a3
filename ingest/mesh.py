"""load_mesh: the object's surface from OBJ, PLY, STL, GLB or glTF, bounded and in metres."""

from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64

from ingest.mesh_files.file_parts import (
    MAX_BYTES,
    MAX_FACES,
    ReadMesh,
    decoding,
    joined_parts,
    joined_picture,
    too_large,
)
from ingest.mesh_files.mesh_file import FORMATS, Y_UP, read_mesh_file
from omomo_core.errors import InputError, in_own_words
from omomo_core.motion import ObjectMesh, Texture

MIN_EXTENT, MAX_EXTENT = 0.02, 5.0
"""Metres; the largest side of an object that a phone is clamped to and a person moves."""
_R_ZUP_GLTF = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def load_mesh(path: Path, *, scale: float = 1.0) -> ObjectMesh:
    """Read an object's mesh; its frame is the file's, except that glTF is turned z up.

    glTF is y up by specification, so (x, y, z) becomes (x, -z, y); the other formats state no up
    axis and stay as they are. Scenes are joined as they are drawn at rest, equal vertices merged, unused
    ones dropped. A base colour texture is read with it; notes say what was done to read the file.

    Args:
        path: the mesh file (at most 200 MB and 2 million faces).
        scale: multiplies the vertices, e.g. 0.01 for a file in centimetres.

    Raises:
        InputError: "mesh-missing", "mesh-format", "mesh-too-large", "mesh-unreadable",
            "mesh-empty", "mesh-not-finite", "mesh-truncated", "mesh-scale", "mesh-units"; of glTF
            "gltf-version", "gltf-extension", "gltf-compressed" or "gltf-external".
    """
    _check_file(path)
    if not 0 < scale < float("inf"):
        raise InputError("mesh-scale", f"A mesh cannot be scaled by {scale:g}.", where=str(path))
    file = read_mesh_file(path, MAX_FACES)
    mesh = trimesh.Trimesh(*joined_parts(file.parts), process=False)
    with decoding(path):
        _check_surface(mesh, path, file.notes)
    texture, lost = _texture(file)
    mesh.apply_scale(scale)
    _check_size(mesh.extents, path, scale)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.remove_unreferenced_vertices()
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    if path.suffix.lower() in Y_UP:
        vertices = vertices @ _R_ZUP_GLTF.T
    notes = (*_parts_note(file), *file.notes, *lost)
    return ObjectMesh(vertices, np.asarray(mesh.faces, np.int64), path.stem, texture, notes)


def _texture(file: ReadMesh) -> tuple[Texture | None, tuple[str, ...]]:
    """The pictures of all parts as one, or what is to be told where they cannot be: they shape no motion."""
    try:
        return joined_picture(file.parts), ()
    except Exception as problem:  # the decoders raise anything on a damaged picture
        return None, (f"its pictures left out ({in_own_words(problem)})",)


def _parts_note(file: ReadMesh) -> tuple[str, ...]:
    return (f"{len(file.parts)} parts",) if len(file.parts) > 1 else ()


def _check_file(path: Path) -> None:
    if not path.is_file():
        raise InputError(
            "mesh-missing", "There is no such mesh file.", where=str(path), fix="Check the path."
        )
    if path.suffix.lower() not in FORMATS:
        raise InputError(
            "mesh-format",
            f"{path.name} is of a kind that is not read.",
            where=str(path),
            fix=f"Export the object as one of {', '.join(FORMATS)}.",
        )
    if path.stat().st_size > MAX_BYTES:
        raise too_large(path, f"{path.stat().st_size / 1e6:.0f} MB")


def _check_surface(mesh: trimesh.Trimesh, path: Path, notes: tuple[str, ...]) -> None:
    if len(mesh.faces) == 0:
        raise InputError(
            "mesh-empty",
            f"{path.name} has no triangles ({'; '.join(notes) or 'a point cloud or an empty file'}).",
            where=str(path),
            fix="Export the object's surface as triangles.",
        )
    if not np.isfinite(mesh.vertices).all():
        raise InputError(
            "mesh-not-finite",
            f"{path.name} has vertices that are NaN or infinite.",
            where=str(path),
            fix="Export the mesh again.",
        )
    if not mesh.nondegenerate_faces().any():
        raise InputError(
            "mesh-empty",
            f"None of the {len(mesh.faces)} triangles of {path.name} has any area: their corners are in "
            "one line.",
            where=str(path),
            fix="Export the object's surface as triangles.",
        )


def _check_size(extents: Float64[np.ndarray, "3"], path: Path, scale: float) -> None:
    largest = float(extents.max())
    if MIN_EXTENT <= largest <= MAX_EXTENT:
        return
    sides = " x ".join(f"{side:.4g}" for side in extents)
    guess = next((s for s in (0.01, 0.001) if 0.1 <= largest * s <= 2.5), None)
    rescale = (
        f"If it is in {'centimetres' if guess == 0.01 else 'millimetres'}, "
        f"scale it (‹mesh_scale› {guess * scale:g} where a command has that option)."
        if guess
        else "Scale it to metres (‹mesh_scale› where a command has that option)."
    )
    raise InputError(
        "mesh-units",
        f"The object measures {sides} m; a thing that a person moves has its largest side between "
        f"{MIN_EXTENT:g} and {MAX_EXTENT:g} m.",
        where=str(path),
        fix=rescale,
    )
