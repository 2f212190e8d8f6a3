"""load_mesh: the object's surface from OBJ, PLY, STL, GLB or glTF, bounded and in metres."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64

from ingest.mesh_texture import read_texture
from omomo_core.errors import InputError, reader_complaint
from omomo_core.motion import ObjectMesh

FORMATS = (".obj", ".ply", ".stl", ".glb", ".gltf")
MAX_BYTES = 200 * 10**6
MAX_FACES = 2_000_000
MIN_EXTENT, MAX_EXTENT = 0.02, 5.0
"""Metres; the largest side of an object that a phone is clamped to and a person moves."""
_R_ZUP_GLTF = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_HEAD = 65536
"""Bytes within which the header of a PLY file ends."""


def load_mesh(path: Path, *, scale: float = 1.0) -> ObjectMesh:
    """Read an object's mesh; its frame is the file's, except that glTF is turned z up.

    glTF is y up by specification, so (x, y, z) becomes (x, -z, y); the other formats state no up
    axis and stay as they are. Scenes are joined with their transforms applied, equal vertices
    merged, unused ones dropped. A base colour texture is read with it.

    Args:
        path: the mesh file (at most 200 MB and 2 million faces).
        scale: multiplies the vertices, e.g. 0.01 for a file in centimetres.

    Raises:
        InputError: "mesh-missing", "mesh-format", "mesh-too-large", "mesh-unreadable",
            "mesh-empty", "mesh-not-finite", "mesh-truncated", "mesh-scale" or "mesh-units".
    """
    _check_file(path)
    if not 0 < scale < float("inf"):
        raise InputError("mesh-scale", f"A mesh cannot be scaled by {scale:g}.", where=str(path))
    mesh = _decode(path)
    with decoding(path):
        _check_surface(mesh, path)
    _check_whole(path, mesh)
    texture = read_texture(path, np.asarray(mesh.triangles))
    mesh.apply_scale(scale)
    _check_size(mesh.extents, path, scale)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.remove_unreferenced_vertices()
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    if path.suffix.lower() in (".glb", ".gltf"):
        vertices = vertices @ _R_ZUP_GLTF.T
    return ObjectMesh(vertices, np.asarray(mesh.faces, np.int64), path.stem, texture)


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


def too_large(path: Path, size: str) -> InputError:
    """The error for a mesh file of such a size, "mesh-too-large"."""
    return InputError(
        "mesh-too-large",
        f"{path.name} has {size}; at most {MAX_BYTES / 1e6:.0f} MB and {MAX_FACES:,} triangles "
        "are read.",
        where=str(path),
        fix="Simplify the mesh: 20,000 triangles are plenty for a motion.",
    )


@contextmanager
def decoding(path: Path) -> Generator[None]:
    """Turn whatever a decoder raises on a damaged file into one error.

    Raises:
        InputError: "mesh-unreadable", or what the block raises itself.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as problem:  # the decoders raise anything on a damaged file
        raise InputError(
            "mesh-unreadable",
            f"{path.name} cannot be read: {reader_complaint(problem)}.",
            where=str(path),
            fix="Open it in a 3D program and export it again.",
        ) from problem


def _decode(path: Path) -> trimesh.Trimesh:
    """All the triangles of the file as one mesh."""
    with decoding(path):
        scene = trimesh.load_scene(path, skip_materials=True, process=False)
        triangles = _triangles(scene)
        if triangles > MAX_FACES:  # counted before a scene of many copies is spread out
            raise too_large(path, f"{triangles:,} triangles")
        mesh = scene.to_mesh()
        if len(mesh.faces) and not 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices):
            raise ValueError("a triangle names a vertex that is not there")
    return mesh


def _triangles(scene: trimesh.Scene) -> int:
    """Triangles of all the copies in a scene."""
    counts = {name: len(getattr(part, "faces", ())) for name, part in scene.geometry.items()}
    return sum(len(nodes) * counts[name] for name, nodes in scene.graph.geometry_nodes.items())


def _check_surface(mesh: trimesh.Trimesh, path: Path) -> None:
    if len(mesh.faces) == 0:
        raise InputError(
            "mesh-empty",
            f"{path.name} has no triangles (a point cloud or an empty file).",
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


def _check_whole(path: Path, mesh: trimesh.Trimesh) -> None:
    """Refuse a truncated file.

    The header of ASCII PLY says how many lines follow. OBJ has no such count, but every program writes a
    line end at its end: a file without one is accepted only if the surface is closed and uses all vertices.

    Args:
        path: the mesh file.
        mesh: what was read from it.

    Raises:
        InputError: "mesh-truncated".
    """
    kind = path.suffix.lower()
    if kind == ".ply":
        _check_ply(path)
    elif kind == ".obj" and _ends_amid_a_line(path):
        unused = len(mesh.vertices) - len(np.unique(mesh.faces))
        if unused or not mesh.is_watertight:
            raise _cut(path, "it ends in the middle of a line")


def _ends_amid_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, 2)
        return file.read(1) not in b"\r\n"


def _check_ply(path: Path) -> None:
    with path.open("rb") as file:
        head = file.read(_HEAD)
        header, found, _ = head.partition(b"end_header")
        if not found or b"format ascii" not in header:
            return
        wanted = sum(
            int(words[2])
            for words in (line.split() for line in header.splitlines())
            if len(words) == 3 and words[0] == b"element" and words[2].isdigit()
        )
        file.seek(len(header) + len(found))
        file.readline()
        there = sum(1 for line in file if line.strip())
    if there < wanted:
        raise _cut(path, f"{there} lines follow its header instead of {wanted}")


def _cut(path: Path, how: str) -> InputError:
    return InputError(
        "mesh-truncated",
        f"{path.name} is cut short: {how}.",
        where=str(path),
        fix="Copy the file again, or export the mesh again.",
    )
