"""Vertex normals fast enough for every frame, and meshes split along their sharp edges."""

import numpy as np
import trimesh
from jaxtyping import Float, Float32, Int
from scipy import sparse

from omomo_core.geometry.surface import SplitSurface, split_creases

CREASE = np.radians(35.0)
"""Faces that meet at a sharper angle keep a hard edge."""


class VertexNormals:
    """Area-weighted smooth normals of a mesh whose faces stay and whose vertices move."""

    def __init__(self, faces: Int[np.ndarray, "faces 3"], count: int) -> None:
        self._corners = [np.ascontiguousarray(faces[:, k]) for k in range(3)]
        column = np.repeat(np.arange(len(faces)), 3)
        ones = np.ones(len(column), np.float32)
        self._gather = sparse.csr_matrix((ones, (faces.ravel(), column)), (count, len(faces)))

    def __call__(self, vertices: Float[np.ndarray, "verts 3"]) -> Float32[np.ndarray, "verts 3"]:
        """Unit normals; zero where a vertex has no face with an area."""
        x = vertices.astype(np.float32, copy=False)
        a, b, c = (x.take(corner, axis=0) for corner in self._corners)
        total = self._gather @ _cross(b - a, c - a)
        length = np.sqrt(np.einsum("ij,ij->i", total, total))[:, None]
        return (total / np.maximum(length, 1e-20)).astype(np.float32, copy=False)


def _cross(
    a: Float32[np.ndarray, "n 3"], b: Float32[np.ndarray, "n 3"]
) -> Float32[np.ndarray, "n 3"]:
    """Cross products, in a third of the time that numpy's take."""
    out = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return out


def split_mesh(
    vertices: Float[np.ndarray, "verts 3"],
    faces: Int[np.ndarray, "faces 3"],
    uv: Float[np.ndarray, "faces 3 2"] | None = None,
) -> SplitSurface:
    """The surface of a mesh for drawing: equal vertices are one, and those on creases are doubled."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return split_creases(np.asarray(mesh.vertices), np.asarray(mesh.faces), CREASE, uv)
