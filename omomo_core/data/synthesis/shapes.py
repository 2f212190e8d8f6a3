"""Boxes, cylinders and bars with uneven tessellation, and solids made of several of them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Part:
    """One piece of a solid: its surface, and the box it fills (for collision)."""

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    low: Float[np.ndarray, " 3"]
    high: Float[np.ndarray, " 3"]


def box(
    rng: np.random.Generator, low: tuple[float, float, float], high: tuple[float, float, float]
) -> Part:
    """An axis-aligned box whose faces are cut into uneven grids."""
    lo, hi = np.array(low), np.array(high)
    spacing = rng.uniform(0.04, 0.11)
    cuts = [_cuts(rng, lo[a], hi[a], spacing) for a in range(3)]
    vertices: list[Float[np.ndarray, "n 3"]] = []
    faces: list[Int[np.ndarray, "n 3"]] = []
    count = 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for value, outward in ((lo[axis], False), (hi[axis], True)):
            grid = np.zeros((len(cuts[u]), len(cuts[v]), 3))
            grid[..., axis] = value
            grid[..., u] = cuts[u][:, None]
            grid[..., v] = cuts[v][None, :]
            vertices.append(grid.reshape(-1, 3))
            faces.append(_grid_faces(len(cuts[u]), len(cuts[v]), outward) + count)
            count += len(vertices[-1])
    return Part(np.concatenate(vertices), np.concatenate(faces), lo, hi)


def cylinder(
    rng: np.random.Generator,
    centre: tuple[float, float],
    bottom: float,
    top: float,
    radii: tuple[float, float],
) -> Part:
    """An upright closed cylinder or truncated cone (radii: at the bottom, at the top)."""
    around = int(rng.integers(10, 28))
    heights = _cuts(rng, bottom, top, rng.uniform(0.08, 0.25))
    angles = np.linspace(0.0, 2 * np.pi, around, endpoint=False)
    radius = np.interp(heights, [bottom, top], radii)
    rings = np.zeros((len(heights), around, 3))
    rings[..., 0] = centre[0] + radius[:, None] * np.cos(angles)
    rings[..., 1] = centre[1] + radius[:, None] * np.sin(angles)
    rings[..., 2] = heights[:, None]
    caps = np.array([[*centre, bottom], [*centre, top]])
    vertices = np.concatenate([rings.reshape(-1, 3), caps])
    k = np.arange(around)
    n = (k + 1) % around
    last, base = (len(heights) - 1) * around, len(heights) * around
    faces = [
        np.stack([np.full(around, base), n, k], axis=1),
        np.stack([np.full(around, base + 1), last + k, last + n], axis=1),
    ]
    for ring in range(len(heights) - 1):
        a, b = ring * around, (ring + 1) * around
        faces.append(np.stack([a + k, a + n, b + n], axis=1))
        faces.append(np.stack([a + k, b + n, b + k], axis=1))
    widest = max(radii)
    low = np.array([centre[0] - widest, centre[1] - widest, bottom])
    high = np.array([centre[0] + widest, centre[1] + widest, top])
    return Part(vertices, np.concatenate(faces), low, high)


def joined(
    parts: list[Part],
) -> tuple[Float[np.ndarray, "verts 3"], Int[np.ndarray, "faces 3"]]:
    """Vertices and faces of all parts as one mesh."""
    starts = np.cumsum([0] + [len(p.vertices) for p in parts[:-1]])
    faces = [p.faces + start for p, start in zip(parts, starts, strict=True)]
    return np.concatenate([p.vertices for p in parts]), np.concatenate(faces)


def _cuts(
    rng: np.random.Generator, low: float, high: float, spacing: float
) -> Float[np.ndarray, " cuts"]:
    """Both ends and a few places between them, unevenly spread."""
    count = int(np.clip(round((high - low) / spacing), 1, 10))
    even = np.linspace(0.0, 1.0, count + 1)
    even[1:-1] += rng.uniform(-0.3, 0.3, count - 1) / count
    return low + (high - low) * even


def _grid_faces(rows: int, columns: int, outward: bool) -> Int[np.ndarray, "faces 3"]:
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    b, c, d = a + columns, a + columns + 1, a + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return faces if outward else faces[:, ::-1]
