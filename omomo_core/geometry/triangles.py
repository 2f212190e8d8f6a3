"""Triangles in a tree of boxes, which answers quickly what is near and what is in between."""

import igl
import numpy as np
from jaxtyping import Bool, Float, Int


class Triangles:
    """The triangles of a mesh."""

    def __init__(
        self, vertices: Float[np.ndarray, "verts 3"], faces: Int[np.ndarray, "faces 3"]
    ) -> None:
        """Build the tree; vertices in any frame and unit, in which all questions are then asked."""
        self.mesh = np.asarray(vertices, float), np.asarray(faces, np.int64)
        self._boxes = igl.AABB()
        self._boxes.init(*self.mesh)

    def distance(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " points"]:
        """Return the distance to the nearest triangle."""
        return np.sqrt(np.asarray(self._boxes.squared_distance(*self.mesh, points)[0]))

    def nearest(
        self, points: Float[np.ndarray, "points 3"]
    ) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
        """Return the distance to the nearest place of the surface, and that place."""
        squared, _, place = self._boxes.squared_distance(*self.mesh, points)
        return np.sqrt(np.asarray(squared)).reshape(-1), np.asarray(place).reshape(-1, 3)

    def between(
        self, a: Float[np.ndarray, "*b 3"], b: Float[np.ndarray, "*b 3"]
    ) -> Bool[np.ndarray, "*b"]:
        """Return whether the straight line from `a` to `b` passes through a triangle."""
        if not a.size:
            return np.zeros(a.shape[:-1], np.bool_)
        rays = np.ascontiguousarray(a.reshape(-1, 3)), np.ascontiguousarray((b - a).reshape(-1, 3))
        triangle, share, _ = self._boxes.intersect_ray_first(*self.mesh, *rays)
        hit = (np.asarray(triangle) != -1) & (np.asarray(share) <= 1.0)
        return hit.reshape(a.shape[:-1])
