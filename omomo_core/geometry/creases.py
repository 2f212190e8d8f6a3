"""split_creases: a surface with its vertices doubled where shading must not run on."""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float, Int


@dataclass(frozen=True)
class SplitSurface:
    """A surface for drawing: smooth normals at its vertices give the wanted shading."""

    vertices: Float[np.ndarray, "split 3"]
    normals: Float[np.ndarray, "split 3"]
    """Not of unit length where a vertex has no face with an area."""
    faces: Int[np.ndarray, "faces 3"]
    uv: Float[np.ndarray, "split 2"] | None = None
    """Of the vertices, as `omomo_core.motion.Texture` has them of corners."""


def split_creases(
    vertices: Float[np.ndarray, "verts 3"],
    faces: Int[np.ndarray, "faces 3"],
    angle: float,
    uv: Float[np.ndarray, "faces 3 2"] | None = None,
) -> SplitSurface:
    """The same surface with vertices doubled along its creases and the seams of its texture.

    Smooth normals then leave the edges of a box sharp and the bend of a pipe round.

    Args:
        vertices, faces: of the surface.
        angle: faces that meet at more than this (radians) meet in a crease.
        uv: of the corners of the faces.
    """
    source = trimesh.Trimesh(vertices, faces, process=False)
    smooth = trimesh.graph.smooth_shade(source, angle=angle)
    split = SplitSurface(
        np.asarray(smooth.vertices), np.asarray(smooth.vertex_normals), np.asarray(smooth.faces)
    )
    if uv is None:
        return split
    # smooth_shade puts the faces into another order, which it notes.
    parts = smooth.metadata.get("original_components")
    return _split_seams(split, uv if parts is None else uv[np.concatenate(parts)])


def _split_seams(surface: SplitSurface, uv: Float[np.ndarray, "faces 3 2"]) -> SplitSurface:
    corner, flat = surface.faces.ravel(), uv.reshape(-1, 2)
    key = np.column_stack([corner, np.rint(flat * 2**16)])
    _, first, faces = np.unique(key, axis=0, return_index=True, return_inverse=True)
    kept = corner[first]
    return SplitSurface(
        surface.vertices[kept], surface.normals[kept], faces.reshape(-1, 3), flat[first]
    )
