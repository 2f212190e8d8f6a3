"""Surfaces of meshes: even samples, exact distances to triangles, and vertices split at creases."""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int
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


@dataclass(frozen=True)
class SplitSurface:
    """A surface for drawing: smooth normals at its vertices give the wanted shading."""

    vertices: Float[np.ndarray, "split 3"]
    normals: Float[np.ndarray, "split 3"]
    """Normals; not of unit length where a vertex has no face with an area."""
    faces: Int[np.ndarray, "faces 3"]
    uv: Float[np.ndarray, "split 2"] | None = None
    """Texture coordinates of the vertices, as `omomo_core.motion.Texture` has them of corners."""


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


def inside_mesh(
    mesh: ObjectMesh, points: Float[np.ndarray, "points 3"]
) -> Bool[np.ndarray, " points"]:
    """Return which points are inside a mesh that may have holes (generalised winding number).

    Args:
        mesh: the object.
        points: its frame, metres.
    """
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    turns = np.asarray(igl.fast_winding_number(vertices, faces, points)).reshape(-1)
    return np.asarray(np.abs(turns) > 0.5)
