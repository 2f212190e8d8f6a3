"""The surface of an object as points: what the encodings and the contact rules measure against."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import KDTree

from omomo_core.motion import ObjectMesh

SURFACE_POINTS = 4096


@dataclass(frozen=True)
class Surface:
    """Area-uniform samples of a mesh: independent of how the scan was tessellated."""

    points: Float[np.ndarray, "points 3"]
    """In the object's frame, metres."""
    normals: Float[np.ndarray, "points 3"]
    """Unit normals of the faces they lie on, as the mesh winds them."""

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
    return Surface(points=points, normals=np.asarray(solid.face_normals)[face])
