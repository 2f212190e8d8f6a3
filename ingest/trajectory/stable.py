"""On which sides an object can stand by itself, and how far a pose is from standing."""

import numpy as np
from jaxtyping import Float, Float64
from scipy.spatial import ConvexHull, QhullError

from ingest.trajectory.config import STANDING
from omomo_core.motion import ObjectMesh


def standing_sides(mesh: ObjectMesh) -> Float64[np.ndarray, "sides 3"]:
    """Directions (unit, object frame) that may point down while the object stands by itself.

    The normals of the convex hull whose support has the centre of the hull above it. Round things
    have many, flat meshes none.
    """
    vertices = mesh.vertices.astype(np.float64)
    try:
        hull = ConvexHull(vertices)
    except QhullError:
        return np.empty((0, 3))
    corners = vertices[hull.vertices]
    centre = corners.mean(axis=0)
    normals = np.unique(hull.equations[:, :3].round(2), axis=0)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    slack = STANDING.flatness * float(np.ptp(corners, axis=0).max())
    return np.array([n for n in normals if _stands(corners, centre, n, slack)]).reshape(-1, 3)


def _stands(
    corners: Float64[np.ndarray, "corners 3"],
    centre: Float64[np.ndarray, "3"],
    down: Float64[np.ndarray, "3"],
    slack: float,
) -> bool:
    """Whether the centre is above the support: seen from it, no half turn is without a foot."""
    depth = corners @ down
    feet = corners[depth > depth.max() - slack] - centre
    across = np.linalg.svd(down[None])[2][1:]
    angles = np.sort(np.arctan2(*(feet @ across.T).T))
    gaps = np.diff(np.concatenate([angles, angles[:1] + 2 * np.pi]))
    return bool(gaps.max() < np.pi)


def tilt_from_standing(
    R_world_object: Float[np.ndarray, "3 3"], sides: Float64[np.ndarray, "sides 3"]
) -> tuple[float, int]:
    """Degrees between a pose (world z up) and the nearest one in which it stands, and its side."""
    cosines = sides @ -R_world_object[2]
    side = int(np.argmax(cosines))
    return float(np.degrees(np.arccos(np.clip(cosines[side], -1, 1)))), side
