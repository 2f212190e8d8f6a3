"""Rays against the surface of a prop."""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Hits:
    """What each ray met first."""

    distance: Float[np.ndarray, " rays"]
    """Metres; inf where it met nothing."""
    points: Float[np.ndarray, "rays 3"]
    normals: Float[np.ndarray, "rays 3"]
    """Outward, unit; zero where it met nothing."""
    faces: Int[np.ndarray, " rays"]
    """-1 where it met nothing."""


class RayMesh:
    """A triangle mesh that can be asked what a ray meets first."""

    def __init__(
        self, vertices: Float[np.ndarray, "verts 3"], faces: Int[np.ndarray, "faces 3"]
    ) -> None:
        self.low, self.high = vertices.min(axis=0), vertices.max(axis=0)
        self.triangles = vertices[faces]
        cross = np.cross(
            self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0]
        )
        doubled = np.linalg.norm(cross, axis=1)
        self.areas = doubled / 2
        self.normals = cross / np.maximum(doubled, 1e-12)[:, None]
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, self.triangles.astype(np.float32))

    def cast(
        self, origins: Float[np.ndarray, "rays 3"], directions: Float[np.ndarray, "rays 3"]
    ) -> Hits:
        """The first surface along each ray of unit direction."""
        found = self._scene.run(
            np.ascontiguousarray(origins, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
            query="INTERSECT",
            output=True,
        )
        face = found["primID"].astype(np.int64)
        met = face >= 0
        distance = np.where(met, found["tfar"].astype(float), np.inf)
        points = origins + np.where(met, distance, 0.0)[:, None] * directions
        return Hits(distance, points, self.normals[face] * met[:, None], face)
