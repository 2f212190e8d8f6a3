"""solid_surface: the closed surface between what is solid and what is empty in a volume."""

import cv2
import igl
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64
from scipy.ndimage import gaussian_filter1d, map_coordinates

from ingest.scan.dense.volume import Box

_BLUR = 0.7
"""Voxels; noise of single voxels is no shape."""
_THIN = 1e-6
"""Metres: the floor lies so far below the first slice."""
_CORNERS = np.array(
    [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0], [1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]]
)
"""Of a cell, z y x, in the order of marching cubes."""


def solid_surface(
    field: Float32[np.ndarray, "z y x"], box: Box
) -> tuple[Float64[np.ndarray, "verts 3"], Int64[np.ndarray, "faces 3"]]:
    """Vertices in the floor's frame (metres) and faces, cut and closed at the floor; maybe none."""
    field = _blurred(field)
    field[:, [0, -1]] = field[:, :, [0, -1]] = 1.0
    field[-1] = 1.0
    # One slice more, of air, right below the floor.
    field = np.concatenate([np.ones_like(field[:1]), field])
    cells = _crossed(field < 0)
    if not len(cells):
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    corners = np.ravel_multi_index(tuple((cells[:, None] + _CORNERS).reshape(-1, 3).T), field.shape)
    used, cubes = np.unique(corners, return_inverse=True)
    places = _places(np.stack(np.unravel_index(used, field.shape), axis=1), box)
    values = field.reshape(-1)[used].astype(np.float64)
    vertices, faces, _ = igl.marching_cubes(values, places, cubes.reshape(-1, 8).astype(np.int64))
    return np.asarray(vertices, np.float64), np.asarray(faces, np.int64)


def _blurred(field: Float32[np.ndarray, "z y x"]) -> Float32[np.ndarray, "z y x"]:
    for index, level in enumerate(field):
        field[index] = cv2.GaussianBlur(level, (0, 0), _BLUR)
    return np.asarray(gaussian_filter1d(field, _BLUR, axis=0, mode="nearest"), np.float32)


def _crossed(solid: Bool[np.ndarray, "z y x"]) -> Int64[np.ndarray, "cells 3"]:
    """Cells whose corners are not all alike."""
    z, y, x = (side - 1 for side in solid.shape)
    count = np.zeros((z, y, x), np.int8)
    for dz, dy, dx in _CORNERS:
        count += solid[dz : dz + z, dy : dy + y, dx : dx + x]
    return np.argwhere((count > 0) & (count < len(_CORNERS)))


def _places(grid: Int64[np.ndarray, "points 3"], box: Box) -> Float64[np.ndarray, "points 3"]:
    """Where grid points (z y x, the first slice being the one below the floor) are."""
    z = box.low[2] + (grid[:, 0] - 1) * box.voxel
    z[grid[:, 0] == 0] = box.low[2] - _THIN
    x, y = (box.low[k] + grid[:, 2 - k] * box.voxel for k in range(2))
    return np.stack([x, y, z], axis=1)


def seen_at(
    vertices: Float64[np.ndarray, "verts 3"],
    seen: Float32[np.ndarray, "z y x"],
    box: Box,
    fewest: float,
) -> Bool[np.ndarray, " verts"]:
    """Which vertices lie where at least `fewest` views saw a surface."""
    grid = (vertices - box.low) / box.voxel
    found = map_coordinates(seen, grid[:, ::-1].T, order=1, mode="nearest")
    return np.asarray(found) >= fewest
