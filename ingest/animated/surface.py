"""The surface of an object that stands in the same file as its motion."""

from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64, Int

from ingest.mesh import MAX_FACES
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

Part = tuple[Float64[np.ndarray, "verts 3"], Int[np.ndarray, "faces 3"]]


def joined(
    parts: list[Part], stretch: Float64[np.ndarray, "3 3"], name: str, source: Path
) -> ObjectMesh | None:
    """All parts as one mesh, stretched; equal vertices merged. None when there is no part.

    Raises:
        InputError: "mesh-unreadable" for a triangle without its vertices, "mesh-not-finite" or
            "mesh-too-large".
    """
    if not parts:
        return None
    _check(parts, source)
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    vertices = np.concatenate([v for v, _ in parts]) @ stretch.T
    faces = np.concatenate([f + k for (_, f), k in zip(parts, offsets, strict=True)])
    if np.linalg.det(stretch) < 0:  # a mirror turns triangles inside out
        faces = faces[:, ::-1]
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    mesh.remove_unreferenced_vertices()
    return ObjectMesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), name)


def _check(parts: list[Part], source: Path) -> None:
    triangles = sum(len(faces) for _, faces in parts)
    if triangles > MAX_FACES:
        raise InputError(
            "mesh-too-large",
            f"The object has {triangles:,} triangles; at most {MAX_FACES:,} are read.",
            where=str(source),
            fix="Simplify the mesh: 20,000 triangles are plenty for a motion.",
        )
    for vertices, faces in parts:
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
            raise InputError(
                "mesh-unreadable",
                "A triangle of the object names a vertex that is not there.",
                where=str(source),
                fix="Export the file again.",
            )
        if not np.isfinite(vertices).all():
            raise InputError(
                "mesh-not-finite",
                "The object has vertices that are NaN or infinite.",
                where=str(source),
                fix="Export the file again.",
            )
