"""The flat sides that an object stands on, as planes in its own frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from ingest.trajectory.stable import standing_sides
from omomo_core.motion import ObjectMesh

_ONE_SIDE = np.radians(4.0)
"""Facets of the hull that differ by less, one to the next, are one side of a rough mesh."""
_APART = np.radians(15.0)
"""A side that has another one nearer than this is part of something round."""
_SLACK = 0.01
"""Part of the object's size by which feet may differ in height and still all stand."""
_MESH_TILT = np.radians(0.3)
"""A scan's feet are out by a millimetre or two over half a metre."""
_NARROW = 0.02
"""Part of the object's size: feet nearer to one line than this bear no plane."""


@dataclass(frozen=True)
class Side:
    """Where the object touches the floor when it stands on this side."""

    down: Float64[np.ndarray, "3"]
    """Unit vector in the object's frame that points down then."""
    centre: Float64[np.ndarray, "3"]
    """Point of that plane amid the feet, object frame, metres."""
    sd: float
    """How well `down` is known in each direction, rad."""


def flat_sides(mesh: ObjectMesh) -> list[Side]:
    """The sides on which the object stands so firmly that they tell how it is tilted.

    Round things and flat meshes have none.
    """
    normals = standing_sides(mesh)
    if len(normals) == 0:
        return []
    corners = mesh.vertices.astype(np.float64)
    corners = corners[ConvexHull(corners).vertices]
    count, label = connected_components(normals @ normals.T > np.cos(_ONE_SIDE), directed=False)
    found: list[Side] = []
    for side in range(count):
        own, others = normals[label == side], normals[label != side]
        mean = own.mean(axis=0) / np.linalg.norm(own.mean(axis=0))
        near_own, near_others = (own @ mean).min(), (others @ mean).max(initial=-1.0)
        if near_own > np.cos(_ONE_SIDE) and near_others < np.cos(_APART):
            plane = _plane(corners, mean)
            found += [plane] if plane else []
    return found


def _plane(
    corners: Float64[np.ndarray, "corners 3"], down: Float64[np.ndarray, "3"]
) -> Side | None:
    """The plane through the feet of one side."""
    depth = corners @ down
    size = float(np.ptp(corners, axis=0).max())
    feet = corners[depth > depth.max() - _SLACK * size]
    centre = feet.mean(axis=0)
    spread, axes = np.linalg.svd(feet - centre, full_matrices=True)[1:]
    if len(feet) < 3 or spread[1] < _NARROW * size:
        return None
    normal = axes[2] * np.sign(axes[2] @ down)
    rough = spread[2] if len(spread) > 2 else 0.0
    return Side(normal, centre, float(np.hypot(_MESH_TILT, rough / spread[1])))
