"""The surface of an object that stands in the same file as its motion."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64, Int, UInt8

from ingest.mesh import MAX_FACES
from ingest.mesh_texture import TexturedPart, join_textures, patch
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh, Texture


@dataclass(frozen=True)
class MeshPart:
    """A mesh of the file, or a part of one that has its own material."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    uv: Float64[np.ndarray, "faces 3 2"] | None = None
    """Places of the corners on the picture, as `omomo_core.motion.Texture` has them."""
    image: UInt8[np.ndarray, "h w 3"] | None = None

    def moved(self, T: Float64[np.ndarray, "4 4"]) -> "MeshPart":
        """The part in other axes."""
        return replace(self, vertices=self.vertices @ T[:3, :3].T + T[:3, 3])


def joined(
    parts: list[MeshPart], stretch: Float64[np.ndarray, "3 3"], name: str, source: Path
) -> ObjectMesh | None:
    """All parts as one mesh, stretched; equal vertices merged. None when there is no part.

    Raises:
        InputError: "mesh-unreadable" for a triangle without its vertices, "mesh-not-finite" or
            "mesh-too-large".
    """
    if not parts:
        return None
    _check(parts, source)
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    vertices = np.concatenate([part.vertices for part in parts]) @ stretch.T
    faces = np.concatenate([part.faces + k for part, k in zip(parts, offsets, strict=True)])
    texture = _texture(parts)
    if np.linalg.det(stretch) < 0:  # a mirror turns triangles inside out
        faces = faces[:, ::-1]
        texture = texture and replace(texture, uv=texture.uv[:, ::-1])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    mesh.remove_unreferenced_vertices()
    return ObjectMesh(
        np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), name, texture
    )


def _texture(parts: list[MeshPart]) -> Texture | None:
    """One picture of the parts'; grey where a part has none and another has one."""
    if all(part.image is None for part in parts):
        return None
    plain = patch()
    painted: list[TexturedPart] = []
    for part in parts:
        corners, uv = part.vertices[part.faces], part.uv
        if uv is None or part.image is None:
            painted.append(TexturedPart(corners, np.full((*part.faces.shape, 2), 0.5), plain))
        else:
            painted.append(TexturedPart(corners, uv, part.image))
    return join_textures(painted)


def _check(parts: list[MeshPart], source: Path) -> None:
    triangles = sum(len(part.faces) for part in parts)
    if triangles > MAX_FACES:
        raise InputError(
            "mesh-too-large",
            f"The object has {triangles:,} triangles; at most {MAX_FACES:,} are read.",
            where=str(source),
            fix="Simplify the mesh: 20,000 triangles are plenty for a motion.",
        )
    for vertices, faces in ((part.vertices, part.faces) for part in parts):
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
