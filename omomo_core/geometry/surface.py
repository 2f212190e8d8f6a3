"""The surface of an object as points: what the encodings and the contact rules measure against."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import ConvexHull, KDTree, QhullError

from omomo_core.motion import ObjectMesh

SURFACE_POINTS = 4096


@dataclass(frozen=True)
class Surface:
    """Area-uniform samples of a mesh: independent of how the scan was tessellated."""

    points: Float[np.ndarray, "points 3"]
    """In the object's frame, metres."""
    normals: Float[np.ndarray, "points 3"]
    """Unit normals of the faces they lie on, as the mesh winds them."""
    outline: Float[np.ndarray, "corners 3"]
    """Corners of the convex hull: one of them is the lowest point, however the object is turned."""

    def scaled(self, factor: float) -> "Surface":
        """The surface of the object made larger by a factor."""
        if factor == 1.0:
            return self
        return Surface(self.points * factor, self.normals, self.outline * factor)

    @cached_property
    def tree(self) -> KDTree:
        """Nearest-neighbour index over the points."""
        return KDTree(self.points)

    @cached_property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Mean of the surface, in the object's frame."""
        return self.points.mean(axis=0)


def sample_surface(mesh: ObjectMesh, count: int = SURFACE_POINTS) -> Surface:
    """`count` points uniform in area; the same mesh always gives the same points."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    sampled = trimesh.sample.sample_surface(solid, count, seed=0)
    points, face = np.asarray(sampled[0]), np.asarray(sampled[1])
    normals = np.asarray(solid.face_normals)[face]
    return Surface(points, normals, _outline(mesh.vertices))


def _outline(vertices: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "corners 3"]:
    try:
        return vertices[ConvexHull(vertices).vertices]
    except QhullError:  # a flat mesh
        return vertices
