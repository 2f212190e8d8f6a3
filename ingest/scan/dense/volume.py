"""Depth maps fused in a volume: surface, colours, openness.

Distances along the view are averaged near surfaces (Curless and Levoy 1996). What no picture shows to
be empty stays solid, as their hole filling has it, so the surface is closed: an underside or the depth
of a narrow gap is filled, never invented.

Under a seat or behind a back, air is out of sight just as the inside of a box is. From inside a box
every way sideways meets a surface that was seen; from under a seat most ways lead into the open.
"""

from dataclasses import dataclass
from itertools import product

import cv2
import igl
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64, UInt8
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.spatial import KDTree

from ingest.scan.dense.stereo import (
    DepthMap,
    DepthMaps,
    SmallPictures,
    at_pixels,
    matrix_for,
    pixel_rays,
    projected,
)

_BEHIND = 0.3
"""Part of the band behind a surface in which its word begins to count less: walls are thin."""
_FREE = 0.15
"""What it counts that a view looks through a place, to one that sees a surface there."""
_SEEN, _EMPTY = 1.5, 2.0
"""Views that must see a surface, or nothing, before a place is not solid."""
_FLOOR = 0.01
"""Metres; what is seen no higher than this above the floor is floor."""
_SUNK = 0.03
"""Metres below the floor where views of it are said to end, so that all above it is empty."""
_RIM = 2
"""Voxels around the box."""


Grid = Float32[np.ndarray, "z y x"]


@dataclass(frozen=True)
class Box:
    """A box on the floor, filled with voxels; floor's frame, metres."""

    low: Float64[np.ndarray, "3"]
    voxel: float
    shape: tuple[int, int, int]
    """Voxels along z, y, x."""

    @classmethod
    def of(
        cls, low: Float64[np.ndarray, "3"], high: Float64[np.ndarray, "3"], voxel: float
    ) -> "Box":
        """With a rim on every side but the floor's."""
        first = low - _RIM * voxel * np.array([1.0, 1.0, 0.0])
        count = np.ceil((high - first) / voxel).astype(int) + 1 + _RIM
        return cls(first, voxel, (int(count[2]), int(count[1]), int(count[0])))


class Volume:
    """Sums over views, one slice above the other."""

    def __init__(self, box: Box, band: float) -> None:
        """Nothing is seen yet.

        Args:
            box: where it is.
            band: metres in front of a surface and behind it that its depth speaks of.
        """
        self.box, self._band = box, band
        self._distance = np.zeros(box.shape, np.float32)
        self._surface = np.zeros(box.shape, np.float32)
        self._free = np.zeros(box.shape, np.float32)

    def add(
        self,
        depth: DepthMap,
        matrix: Float64[np.ndarray, "3 3"],
        T_camera_floor: Float64[np.ndarray, "4 4"],
    ) -> None:
        """Integrate the depth map of one more view."""
        depth = _sunk(depth, matrix, T_camera_floor)
        P = matrix @ T_camera_floor[:3]
        step = (P[:, :3] * self.box.voxel).astype(np.float32)
        start = (P[:, :3] @ self.box.low + P[:, 3]).astype(np.float32)
        _, rows, columns = self.box.shape
        x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
        level = [step[k, 0] * x + step[k, 1] * y + start[k] for k in range(3)]
        for index in range(self.box.shape[0]):
            u, v, z = (level[k] + step[k, 2] * np.float32(index) for k in range(3))
            self._add_slice(index, depth, u, v, z)

    def _add_slice(
        self,
        index: int,
        depth: DepthMap,
        u: Float32[np.ndarray, "y x"],
        v: Float32[np.ndarray, "y x"],
        z: Float32[np.ndarray, "y x"],
    ) -> None:
        """`u`, `v` are pixels times depth `z`."""
        ahead = np.maximum(z, np.float32(1e-3))
        shown = cv2.remap(depth, u / ahead, v / ahead, cv2.INTER_NEAREST, borderValue=0)
        beyond = (shown - z) / np.float32(self._band)
        known = (shown > 0) & (z > 0)
        near = known & (beyond > -1) & (beyond < 1)
        trust = near * ((beyond + 1) / np.float32(1 - _BEHIND)).clip(0, 1)
        self._distance[index] += trust * beyond
        self._surface[index] += trust
        self._free[index] += known & (beyond >= 1)

    def field(self) -> Grid:
        """Below 0 in what is solid or unseen, above it in what is empty; about distances in bands."""
        return self.judged(self._free)[0]

    def judged(self, free: Grid) -> tuple[Grid, Bool[np.ndarray, "z y x"]]:
        """The field, and what is unseen, if so many views see through each place."""
        through = np.float32(_FREE) * free
        weight = self._surface + through
        field = (self._distance + through) / np.maximum(weight, np.float32(1e-6))
        unseen = (self._surface < _SEEN) & (free < _EMPTY)
        field[unseen] = -1.0
        return field, unseen

    def free(self) -> Grid:
        """How many views see through each place."""
        return self._free

    @property
    def band(self) -> float:
        """Metres in front of a surface and behind it that its depth speaks of."""
        return self._band

    def seen(self) -> Grid:
        """How many views saw a surface at each place."""
        return self._surface


def grounded(field: Grid, box: Box, foot: float = 0.0) -> Grid:
    """The field in which what stands just above the floor goes straight down.

    No view tells a floor from what is just above it.

    Args:
        field, box: of the region.
        foot: metres above the floor from which on what is solid goes down to it as well.
    """
    low, high = (min(int(np.ceil(z / box.voxel)), len(field) - 1) for z in (_FLOOR, foot))
    field[:low] = field[low]
    field[:high] = np.minimum(field[:high], field[high])
    return field


def _sunk(
    depth: DepthMap,
    matrix: Float64[np.ndarray, "3 3"],
    T_camera_floor: Float64[np.ndarray, "4 4"],
) -> DepthMap:
    """Depth in which the floor lies deeper than it is."""
    down = T_camera_floor[:3, 2].astype(np.float32)
    height = -float(T_camera_floor[:3, 2] @ T_camera_floor[:3, 3])
    rise = pixel_rays(depth.shape, matrix) @ down
    floor = (depth > 0) & (height + rise * depth < _FLOOR) & (rise < 0)
    sunk = (-_SUNK - height) / np.minimum(rise, np.float32(-1e-3))
    return np.where(floor, sunk, depth).astype(np.float32)


_BLUR = 0.7
"""Voxels; noise of single voxels is no shape."""
_THIN = 1e-6
"""Metres: the floor lies so far below the first slice."""
_CORNERS = np.array(
    [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0], [1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]]
)
"""Corners of a cell, z y x, in the order of marching cubes."""


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
    """Return the places of grid points (z y x; the first slice is the one below the floor)."""
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


_CLOSE, _CLOSE_SHARE = 0.01, 0.01
"""Metres, and parts of the depth, that a place may lie beside what a view sees there."""
_FRONTAL = 4
"""Power of the cosine to the normal: who looks straight at a place knows its colour best."""
_PLAIN = 160


def coloured(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    pictures: SmallPictures,
    depths: DepthMaps,
) -> UInt8[np.ndarray, "verts 3"]:
    """Mean colour that the views show of each vertex; of the nearest that is shown for the others.

    Args:
        vertices, faces: world, metres; faces are wound to look outwards.
        pictures: of the views.
        depths: of the views, 0 where unknown; of any size.
    """
    normals = np.asarray(igl.per_vertex_normals(vertices, faces), np.float64)
    total = np.zeros((len(vertices), 3), np.float32)
    weights = np.zeros(len(vertices), np.float32)
    for index, depth in enumerate(depths):
        weight = _sight(vertices, normals, pictures, index, depth)
        shown = _sampled(vertices, pictures, index)
        total += weight[:, None] * shown
        weights += weight
    known = weights > 0
    if not known.any():
        return np.full((len(vertices), 3), _PLAIN, np.uint8)
    colours = total / np.maximum(weights, 1e-9)[:, None]
    if not known.all():
        colours[~known] = colours[known][KDTree(vertices[known]).query(vertices[~known])[1]]
    return np.rint(colours).clip(0, 255).astype(np.uint8)


def _sight(
    vertices: Float64[np.ndarray, "verts 3"],
    normals: Float64[np.ndarray, "verts 3"],
    pictures: SmallPictures,
    index: int,
    depth: DepthMap,
) -> Float32[np.ndarray, " verts"]:
    """How well a view sees each vertex; 0 for what is hidden."""
    view = pictures.views[index]
    u, v, z = projected(vertices, view.T_world_camera, matrix_for(view, depth.shape[::-1]))
    shown = at_pixels(depth, u, v, cv2.INTER_NEAREST)
    close = (shown > 0) & (np.abs(shown - z) < _CLOSE + _CLOSE_SHARE * z)
    to_eye = view.T_world_camera[:3, 3] - vertices
    cosine = np.einsum("ij,ij->i", normals, to_eye) / np.linalg.norm(to_eye, axis=1)
    return (close * np.nan_to_num(cosine).clip(0, 1) ** _FRONTAL).astype(np.float32)


def _sampled(
    vertices: Float64[np.ndarray, "verts 3"], pictures: SmallPictures, index: int
) -> Float32[np.ndarray, "verts 3"]:
    """The picture's colour at each vertex, whether it is hidden or not."""
    T = pictures.views[index].T_world_camera
    u, v, _ = projected(vertices, T, pictures.matrix(index))
    return at_pixels(pictures.picture(index).colours, u, v, cv2.INTER_LINEAR).astype(np.float32)


_CELL = 0.012
"""Metres, about: sides of the cells that ways are followed through."""
_SIDEWAYS, _ANYWHERE = 0.6, 0.5
"""Parts of the level directions, or of all, whose ways lead into the open."""

Cells = Bool[np.ndarray, "z y x"]


def open_places(unseen: Cells, blocked: Cells, voxel: float) -> Cells:
    """Unseen places from which most ways lead to places that are seen to be empty.

    Args:
        unseen: no picture says what is there.
        blocked: a surface or something solid is there; what is neither is empty.
        voxel: metres between places.
    """
    factor = max(1, round(_CELL / voxel))
    closed = _shrunk(blocked, factor)
    hidden = _shrunk(unseen, factor) & ~closed
    level, every = np.zeros(hidden.shape, np.float32), np.zeros(hidden.shape, np.float32)
    ways = [(z, y, x) for z, y, x in product((-1, 0, 1), repeat=3) if z or y or x]
    flat = [way for way in ways if way[0] == 0]
    for way in ways:
        free = _escapes(hidden, closed, way)
        every += free
        if way in flat:
            level += free
    found = hidden & ((level >= _SIDEWAYS * len(flat)) | (every >= _ANYWHERE * len(ways)))
    return _grown(found, unseen.shape, factor) & unseen


def _escapes(
    hidden: Cells, closed: Cells, way: tuple[int, int, int]
) -> Float32[np.ndarray, "z y x"]:
    """Whether a straight way leads out of what is hidden without meeting what is closed; not downwards
    through the floor."""
    free = np.pad(~hidden & ~closed, 1, constant_values=True)
    free[0] = False  # The floor.
    passable = np.pad(hidden, 1)
    axis = next(k for k in range(3) if way[k])
    order = range(1, free.shape[axis] - 1)
    swept, through = np.moveaxis(free, axis, 0), np.moveaxis(passable, axis, 0)
    others = [way[k] for k in range(3) if k != axis]
    for index in order if way[axis] < 0 else reversed(order):
        ahead = np.roll(swept[index + way[axis]], [-step for step in others], (0, 1))
        swept[index] |= through[index] & ahead
    return free[1:-1, 1:-1, 1:-1].astype(np.float32)


def _shrunk(places: Cells, factor: int) -> Bool[np.ndarray, "cz cy cx"]:
    """Cells of which any place is marked."""
    if factor == 1:
        return places.copy()
    padded = np.pad(places, [(0, -side % factor) for side in places.shape])
    z, y, x = (side // factor for side in padded.shape)
    return np.asarray(padded.reshape(z, factor, y, factor, x, factor).any(axis=(1, 3, 5)))


def _grown(cells: Bool[np.ndarray, "cz cy cx"], shape: tuple[int, ...], factor: int) -> Cells:
    grown = cells
    for axis in range(3):
        grown = np.repeat(grown, factor, axis=axis)
    return grown[: shape[0], : shape[1], : shape[2]]
