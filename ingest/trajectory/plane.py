"""Fit of the largest plane among points whose normal is near a given direction (RANSAC)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.trajectory.config import DEPTH


@dataclass(frozen=True)
class Plane:
    """The points p with normal @ p == offset."""

    normal: Float64[np.ndarray, "3"]
    """Unit vector, on the side of the direction that it was looked for along."""
    offset: float


def fit_plane(
    points: Float64[np.ndarray, "points 3"], along: Float64[np.ndarray, "3"], max_tilt: float
) -> Plane | None:
    """The plane with the most points within 2 cm whose normal is within max_tilt of `along`.

    Random triples of points are tried (RANSAC), the best is fitted to its points. The seed is
    fixed: the same points give the same plane.

    Args:
        points: metres, any world.
        along: unit vector.
        max_tilt: rad.

    Returns:
        None when no such plane holds a tenth of the points.
    """
    if len(points) < DEPTH.fewest_points:
        return None
    triples = points[np.random.default_rng(0).integers(len(points), size=(DEPTH.plane_trials, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    good = lengths > 1e-9
    normals = normals[good] / lengths[good, None]
    normals *= np.where(normals @ along < 0, -1.0, 1.0)[:, None]
    near = normals @ along >= np.cos(max_tilt)
    normals, anchors = normals[near], triples[good][near, 0]
    if len(normals) == 0:
        return None
    offsets = np.einsum("ij,ij->i", normals, anchors)
    counts = (np.abs(points @ normals.T - offsets) < DEPTH.plane_thickness).sum(axis=0)
    best = int(np.argmax(counts))
    plane = Plane(normals[best], float(offsets[best]))
    for _ in range(3):
        plane = _refined(points[_on(plane, points)], along)
    enough = _on(plane, points).mean() >= DEPTH.smallest_plane
    return plane if enough and plane.normal @ along >= np.cos(max_tilt) else None


def _on(plane: Plane, points: Float64[np.ndarray, "points 3"]) -> Bool[np.ndarray, " points"]:
    return np.abs(points @ plane.normal - plane.offset) < DEPTH.plane_thickness


def _refined(points: Float64[np.ndarray, "points 3"], along: Float64[np.ndarray, "3"]) -> Plane:
    """Least squares: the normal is the direction in which the points spread least."""
    centre = points.mean(axis=0)
    normal = np.linalg.eigh((points - centre).T @ (points - centre))[1][:, 0]
    normal = normal if normal @ along >= 0 else -normal
    return Plane(normal, float(normal @ centre))
