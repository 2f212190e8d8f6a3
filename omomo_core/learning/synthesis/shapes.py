"""Boxes, beams, cylinders and rods as coarse closed surfaces, and solids made of several of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

Point = Sequence[float | int] | Float[np.ndarray, " 3"]

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
_BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
_LONGEST_PIECE = 0.2
"""A slanted piece is cut to this length, so that its bounding box stays close to it, metres."""


@dataclass(frozen=True)
class SolidPart:
    """One piece of a solid: its surface, and the box it fills (for collision)."""

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    low: Float[np.ndarray, " 3"]
    high: Float[np.ndarray, " 3"]
    grip: float = 1.0
    """How readily a hand takes hold of it: 0 for wheels and feet."""

    def moved(
        self, matrix: Float[np.ndarray, "3 3"], offset: Point = (0.0, 0.0, 0.0)
    ) -> "SolidPart":
        """The part turned (or scaled) about the origin, then shifted."""
        vertices = self.vertices @ matrix.T + np.asarray(offset)
        return replace(self, vertices=vertices, low=vertices.min(axis=0), high=vertices.max(axis=0))


def box(low: Point, high: Point, grip: float = 1.0) -> SolidPart:
    """An axis-aligned box."""
    lo, hi = np.asarray(low, float), np.asarray(high, float)
    return SolidPart(lo + _CORNERS * (hi - lo), _BOX_FACES, lo, hi, grip)


def cylinder(
    centre: Sequence[float | int],
    bottom: float,
    top: float,
    radii: tuple[float, float],
    sides: int = 20,
    grip: float = 1.0,
) -> SolidPart:
    """An upright closed cylinder or truncated cone (radii: at the bottom, at the top)."""
    start, end = (*centre, bottom), (*centre, top)
    return _rings(np.array([start, end]), np.array(radii), sides, grip)


def rod(a: Point, b: Point, radius: float, sides: int = 8, grip: float = 1.0) -> list[SolidPart]:
    """A round bar from `a` to `b`; cut into pieces when it is slanted."""
    ends = _cut(np.asarray(a, float), np.asarray(b, float))
    return [_rings(ends[k : k + 2], np.full(2, radius), sides, grip) for k in range(len(ends) - 1)]


def beam(
    a: Point, b: Point, across: Point, width: float, thickness: float, grip: float = 1.0
) -> list[SolidPart]:
    """A rectangular bar from `a` to `b`, `width` wide along `across`; cut when it is slanted."""
    ends = _cut(np.asarray(a, float), np.asarray(b, float))
    along = (ends[-1] - ends[0]) / np.linalg.norm(ends[-1] - ends[0])
    side = np.asarray(across, float) - along * np.dot(across, along)
    side /= np.linalg.norm(side)
    out: list[SolidPart] = []
    for start, end in pairwise(ends):
        axes = np.stack([side * width, np.cross(along, side) * thickness, end - start])
        corners = start + (_CORNERS - [0.5, 0.5, 0.0]) @ axes
        out.append(SolidPart(corners, _BOX_FACES, corners.min(axis=0), corners.max(axis=0), grip))
    return out


def shell(
    bottom: float, top: float, radii: tuple[float, float], wall: float, sides: int = 20
) -> SolidPart:
    """An open round vessel about the z axis: outer wall, rim, inner wall, floor."""
    heights = np.array([bottom, top, top, bottom + wall])
    radius = np.array([radii[0], radii[1], radii[1] - wall, radii[0] - wall])
    path = np.stack([0 * heights, 0 * heights, heights], axis=1)
    return _rings(path, radius, sides, 1.0)


def joined(
    parts: Sequence[SolidPart],
) -> tuple[Float[np.ndarray, "verts 3"], Int[np.ndarray, "faces 3"]]:
    """Vertices and faces of all parts as one mesh."""
    starts = np.cumsum([0] + [len(p.vertices) for p in parts[:-1]])
    faces = [p.faces + start for p, start in zip(parts, starts, strict=True)]
    return np.concatenate([p.vertices for p in parts]), np.concatenate(faces)


def _cut(a: Float[np.ndarray, " 3"], b: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "cuts 3"]:
    span = np.abs(b - a)
    # Only what is long in two directions has a bounding box much larger than itself.
    pieces = int(np.ceil(np.sort(span)[1] / (0.5 * _LONGEST_PIECE)))
    pieces = min(max(pieces, 1), int(np.ceil(np.linalg.norm(span) / _LONGEST_PIECE)))
    return np.linspace(a, b, pieces + 1)


def _rings(
    path: Float[np.ndarray, "rings 3"], radii: Float[np.ndarray, " rings"], sides: int, grip: float
) -> SolidPart:
    """A closed surface of circles along a path whose first and last points give the direction."""
    along = path[1] - path[0]
    along = along / np.linalg.norm(along)
    u = np.cross([0.0, 1.0, 0.0] if abs(along[1]) < 0.9 else [1.0, 0.0, 0.0], along)
    u /= np.linalg.norm(u)
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    circle = np.outer(np.cos(angles), u) + np.outer(np.sin(angles), np.cross(along, u))
    rings = path[:, None] + radii[:, None, None] * circle
    vertices = np.concatenate([rings.reshape(-1, 3), path[[0, -1]]])
    k = np.arange(sides)
    n = (k + 1) % sides
    last, base = (len(path) - 1) * sides, len(path) * sides
    faces = [
        np.stack([np.full(sides, base), n, k], axis=1),
        np.stack([np.full(sides, base + 1), last + k, last + n], axis=1),
    ]
    for ring in range(len(path) - 1):
        a, b = ring * sides, (ring + 1) * sides
        faces.append(np.stack([a + k, a + n, b + n], axis=1))
        faces.append(np.stack([a + k, b + n, b + k], axis=1))
    return SolidPart(
        vertices, np.concatenate(faces), vertices.min(axis=0), vertices.max(axis=0), grip
    )
