"""triangulated: polygons of any number of corners as triangles that cover them, concave ones too."""

import numpy as np
from jaxtyping import Float64, Int64

from omomo_core.errors import DamageError

MOST_CONCAVE = 2000
"""Corners of a concave polygon: cutting it into ears takes the square of their number."""
_STRAIGHT = 1e-9
"""Sine of the turn at a corner, from which on it counts as turning back."""


def triangulated(
    vertices: Float64[np.ndarray, "verts 3"],
    corners: Int64[np.ndarray, " corners"],
    counts: Int64[np.ndarray, " polygons"],
) -> Int64[np.ndarray, "triangles 3"]:
    """Return which of the corners the triangles have, polygon after polygon.

    Convex polygons are fans around their first corner; concave ones are cut so that no triangle lies
    outside. Polygons of fewer than three corners give none.

    Args:
        vertices: that the corners name.
        corners: numbers of vertices, all polygons' one after the other.
        counts: corners of each polygon.

    Raises:
        ValueError: a corner names no vertex, or a concave polygon has more than MOST_CONCAVE corners.
    """
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices):
        raise DamageError("a polygon names a vertex that is not there")
    starts = np.cumsum(counts) - counts
    fans = np.maximum(counts - 2, 0)
    polygon = np.repeat(np.arange(len(counts)), fans)
    first, places = starts[polygon], np.cumsum(fans) - fans
    nth = np.arange(len(polygon)) - np.repeat(places, fans)
    triangles = np.stack([first, first + nth + 1, first + nth + 2], axis=1).astype(np.int64)
    for k in _concave(vertices, corners, counts, starts):
        first, place, many = int(starts[k]), int(places[k]), int(counts[k])
        own = vertices[corners[first : first + many]]
        triangles[place : place + many - 2] = first + _ears(own)
    return triangles


def _concave(
    vertices: Float64[np.ndarray, "verts 3"],
    corners: Int64[np.ndarray, " corners"],
    counts: Int64[np.ndarray, " polygons"],
    starts: Int64[np.ndarray, " polygons"],
) -> Int64[np.ndarray, " concave"]:
    """Numbers of the polygons that turn back at a corner."""
    many = np.flatnonzero(counts > 3)
    if len(many) == 0:
        return np.empty(0, np.int64)
    size = counts[many]
    polygon = np.repeat(np.arange(len(many)), size)
    inside = np.arange(len(polygon)) - np.repeat(np.cumsum(size) - size, size)
    first, length = starts[many][polygon], size[polygon]
    here, after = corners[first + inside], corners[first + (inside + 1) % length]
    before = corners[first + (inside - 1) % length]
    cross = np.cross(vertices[here] - vertices[before], vertices[after] - vertices[here])
    p, q = vertices[here], vertices[after]
    normal = np.zeros((len(many), 3))
    with np.errstate(all="ignore"):  # vertices may be infinite: that is told later
        np.add.at(normal, polygon, np.cross(p - p[np.cumsum(size) - size][polygon], q - p))
        turn = np.einsum("nk,nk->n", cross, normal[polygon])
        scale = np.linalg.norm(normal, axis=1)[polygon] * np.linalg.norm(q - p, axis=1)
        scale *= np.linalg.norm(p - vertices[before], axis=1)
        back = turn < -_STRAIGHT * scale
    return many[np.unique(polygon[back])].astype(np.int64)


def _ears(points: Float64[np.ndarray, "corners 3"]) -> Int64[np.ndarray, "triangles 3"]:
    """Triangles of one polygon, seen along its normal, cut off corner by corner."""
    if len(points) > MOST_CONCAVE:
        raise DamageError(f"a concave polygon has {len(points)} corners: triangulate it")
    flat = _seen_flat(points)
    left, triangles = list(range(len(points))), []
    while len(left) > 3:
        k = _best_ear(flat[left])
        triangles.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        del left[k]
    triangles.append(left)
    return np.array(triangles, np.int64)


def _seen_flat(points: Float64[np.ndarray, "corners 3"]) -> Float64[np.ndarray, "corners 2"]:
    """The corners on the plane in which the polygon turns to the left."""
    own = points - points[0]
    normal = np.cross(own, np.roll(own, -1, axis=0)).sum(axis=0)
    z = normal / max(float(np.linalg.norm(normal)), 1e-300)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= max(float(np.linalg.norm(x)), 1e-300)
    return np.stack([own @ x, own @ np.cross(z, x)], axis=1)


def _best_ear(p: Float64[np.ndarray, "left 2"]) -> int:
    """The corner that can be cut off with nothing inside, of these the one with the widest triangle."""
    before, after = np.roll(p, 1, axis=0), np.roll(p, -1, axis=0)
    turn = _cross(p - before, after - p)
    sides = [np.linalg.norm(a - b, axis=1) for a, b in ((p, before), (p, after), (after, before))]
    shape = turn / np.maximum(sum(side**2 for side in sides), 1e-300)
    for k in np.argsort(-shape, kind="stable"):
        if turn[k] <= 0:
            break
        a, b, c = before[k], p[k], after[k]
        inside = (
            (_cross(b - a, p - a) >= 0) & (_cross(c - b, p - b) >= 0) & (_cross(a - c, p - c) >= 0)
        )
        corner = (p == a).all(axis=1) | (p == b).all(axis=1) | (p == c).all(axis=1)
        if not (inside & ~corner).any():
            return int(k)
    return int(np.argmax(shape))  # a polygon that crosses itself


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
