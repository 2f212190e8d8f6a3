"""Volume: what depth maps say about every place around an object: surface, empty, or never seen.

Distances along the view are averaged near surfaces (Curless and Levoy 1996). What no picture shows to
be empty stays solid, as their hole filling has it, so the surface is closed: an underside or the depth
of a narrow gap is filled, never invented.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64

from ingest.scan.dense.depth_map import DepthMap, pixel_rays

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
