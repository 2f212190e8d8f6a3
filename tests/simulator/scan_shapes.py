"""Textured boxes and tubes; every side shows its own part of the texture."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from omomo_core.motion import ObjectMesh
from render.scene import Drawable

SIDES = 40
"""Of what is round."""


def box(name: str, corners: Float64[np.ndarray, "2 3"]) -> Drawable:
    """A box whose six sides show six parts of a texture."""
    vertices, faces, uv = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for axis in range(3):
        for side in range(2):
            quad = np.empty((4, 3))
            quad[:, axis] = corners[side, axis]
            for k, across in enumerate(((axis + 1) % 3, (axis + 2) % 3)):
                quad[:, across] = corners[0, across] + square[:, k] * np.ptp(corners[:, across])
            outward = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            faces.append(np.array(outward) + 4 * len(vertices))
            vertices.append(quad)
            uv.append((square + np.array([axis, side])) / [3, 2])
    joined = np.concatenate
    return Drawable(name, joined(vertices), joined(faces), uv=joined(uv))


def turned(name: str, outline: Sequence[tuple[float, float]], *, sharp: float = 0.5) -> Drawable:
    """What an outline sweeps when it turns around the z axis.

    Args:
        name: of the drawable.
        outline: radius and height along it, metres; the surface faces its right hand.
        sharp: turn of the outline (rad) beyond which it makes an edge.
    """
    bands = _bands(np.array(outline, float), sharp)
    around = np.linspace(0.0, 2 * np.pi, SIDES + 1)
    ring = np.stack([np.cos(around), np.sin(around)], axis=1)
    lengths = [np.linalg.norm(np.diff(band, axis=0), axis=1).sum() for band in bands]
    ends = np.concatenate([[0.0], np.cumsum(lengths)]) / np.sum(lengths)
    vertices, faces, uv, first = list[np.ndarray](), list[np.ndarray](), list[np.ndarray](), 0
    for band, (low, high) in zip(bands, pairwise(ends), strict=True):
        along = np.concatenate([[0.0], np.linalg.norm(np.diff(band, axis=0), axis=1).cumsum()])
        v = low + (high - low) * along / along[-1]
        level = np.concatenate(
            [band[:, :1, None] * ring, np.tile(band[:, 1:, None], (1, len(ring), 1))], axis=2
        )
        vertices.append(level.reshape(-1, 3))
        uv.append(
            np.stack(np.broadcast_arrays(around / (2 * np.pi), v[:, None]), axis=2).reshape(-1, 2)
        )
        faces.append(first + _grid(len(band), len(ring)))
        first += len(vertices[-1])
    return Drawable(name, np.concatenate(vertices), np.concatenate(faces), uv=np.concatenate(uv))


def _bands(outline: Float64[np.ndarray, "points 2"], sharp: float) -> list[np.ndarray]:
    """The outline cut at its edges, so that normals are not smoothed across them."""
    step = np.diff(outline, axis=0)
    angle = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    cuts = np.flatnonzero(np.abs(np.diff(angle)) > sharp) + 1
    edges = [0, *cuts.tolist(), len(outline) - 1]
    return [outline[a : b + 1] for a, b in pairwise(edges)]


def _grid(rows: int, columns: int) -> np.ndarray:
    """Two triangles for each field of a grid of vertices."""
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    b, c, d = a + 1, a + columns, a + columns + 1
    return np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])


def rod(name: str, radius: float, low: float, high: float) -> Drawable:
    """An upright round bar with both its ends."""
    return turned(name, [(0.0, low), (radius, low), (radius, high), (0.0, high)])


def joined(parts: Sequence[Drawable], name: str) -> ObjectMesh:
    """The surfaces of some parts as one mesh, without triangles that have no area."""
    first = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    vertices = np.concatenate([p.vertices for p in parts])
    faces = np.concatenate([p.faces + at for p, at in zip(parts, first, strict=True)])
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    wide = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12
    return ObjectMesh(vertices, faces[wide], name)
