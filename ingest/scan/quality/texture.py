"""texture_check: whether there is enough to see on the object itself, and not on the room alone."""

import numpy as np
from scipy.spatial import KDTree

from ingest.report.check import Check, graded
from ingest.scan.found import Found
from omomo_core.geometry.transforms import inverse

_NEAR = 0.02
"""Metres between a sparse point and the surface, at most; and at least from it to the floor."""
_FEW = 100.0
"""Sparse points on a square metre of the surface."""


def points_on(found: Found) -> int:
    """Sparse points that lie on the object, those near its floor left out."""
    T = inverse(found.cleaned.T_world_object)
    points = found.registered.points @ T[:3, :3].T + T[:3, 3]
    above = points[points[:, 2] > _NEAR]
    if len(above) == 0:
        return 0
    vertices, faces = found.cleaned.mesh.vertices, found.cleaned.mesh.faces
    known = np.concatenate([vertices, vertices[faces].mean(axis=1)])
    return int((KDTree(known).query(above, distance_upper_bound=_NEAR)[0] < _NEAR).sum())


def area_of(found: Found) -> float:
    """Of the surface, square metres."""
    a, b, c = (found.cleaned.mesh.vertices[found.cleaned.mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def texture_check(found: Found) -> Check:
    """A plain object gives few points, however busy its room is; LiDAR measures it all the same."""
    count, area = points_on(found), area_of(found)
    plain = count < _FEW * area
    message = (
        f"{count:,} points were found on the object itself, {count / area:,.0f} a square metre."
    )
    if plain and found.method == "stereo":
        message += " It has next to no texture, so its shape is partly guessed."
    elif plain:
        message += " It has next to no texture; its shape is what the phone's depth says."
    fix = "Textureless object: stick some tape or paper with a pattern on it, and film it closer."
    return graded("texture", "warn" if plain else "ok", message, fix)
