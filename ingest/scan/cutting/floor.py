"""find_room_floor: the floor of a room's mesh."""

import igl
import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int64

from ingest.scan.region.floor import floor_frame
from omomo_core.errors import InputError

LEVEL = np.radians(15)
"""Between up and the normal of a level triangle."""
_BIN = 0.02
"""Metres of height that are counted together."""
_LOWEST = 0.2
"""A floor has so much of the level surface that the most of any height is."""
_NEAR = 3.0
"""Metres around the object: the floor may slope elsewhere."""
_THICK = 0.05
"""Metres from the floor of what is fitted."""
_ROUNDS = 5
_ROOM = 6.0
"""Metres that the largest side of a mesh of unknown unit is taken for."""
_WIDE, _RISES = 0.3, 0.05
"""Part of its footprint that is floor, and height above it in parts of the footprint's side, of a room."""
_BELOW = 0.02
"""Part of all surface that may lie below a floor, by mistakes of the scan."""
_TILT = np.radians(6)


def level_area(corners: Float64[np.ndarray, "faces 3 3"]) -> float:
    """Square metres at the height that a floor would have; 0 where nothing is level."""
    areas, height = _level(corners)[1:]
    at = _lowest_peak(areas, height)
    return 0.0 if at is None else float(areas[np.abs(height - at) < _THICK].sum())


def has_floor(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> bool:
    """Whether a mesh of any unit, z up, shows a floor with things on it, which no object has.

    A floor looks up, is a good part of all that there is seen from above, ends in an open rim, has
    nothing below, and things rise above it.
    """
    scaled = vertices * (_ROOM / max(float(np.ptp(vertices, axis=0).max()), 1e-9))
    corners = scaled[faces]
    areas, height = _level(corners)[1:]
    at = _lowest_peak(areas, height)
    if at is None:
        return False
    footprint = float(np.ptp(scaled[:, 0]) * np.ptp(scaled[:, 1]))
    wide = areas[np.abs(height - at) < _THICK].sum() > _WIDE * footprint
    rises = scaled[:, 2].max() - at > _RISES * np.sqrt(footprint)
    ends = scaled[np.asarray(igl.boundary_facets(faces)[0]).reshape(-1, 2)]
    low = (np.abs(ends[..., 2] - at) < _THICK).all(axis=1)
    rim = np.linalg.norm(ends[low, 0] - ends[low, 1], axis=1).sum()
    area = trimesh.triangles.area(corners)
    below = area[corners[..., 2].max(axis=1) < at - _THICK].sum() > _BELOW * area.sum()
    return bool(wide and rises and rim > np.sqrt(footprint) and not below)


def find_room_floor(
    corners: Float64[np.ndarray, "faces 3 3"], near: Float64[np.ndarray, "3"] | None, where: str
) -> Float64[np.ndarray, "4 4"]:
    """The lowest wide level surface, tilted as its triangles are: T_world_floor, whose z is its normal.

    Args:
        corners: of the room's triangles, z up, metres.
        near: a point over it; the floor is that around it.
        where: the room came from, for messages.

    Raises:
        InputError: "scan-no-floor".
    """
    level, areas, height = _level(corners)
    middles = corners[level].mean(axis=1)
    if near is not None:
        close = np.linalg.norm((middles - near)[:, :2], axis=1) < _NEAR
        middles, areas, height = middles[close], areas[close], height[close]
    at = _lowest_peak(areas, height)
    if at is None:
        raise InputError(
            "scan-no-floor",
            "Nothing in the mesh is level, as a floor is.",
            where=where,
            fix="Say which axis of the file is up (--up), or export the room with its floor.",
        )
    normal, offset = np.array([0.0, 0.0, 1.0]), at
    for _ in range(_ROUNDS):
        on = np.abs(middles @ normal - offset) < _THICK
        slope = _plane(middles[on], areas[on])
        if slope[2] < np.cos(_TILT):
            break
        normal, offset = slope, float(np.average(middles[on] @ slope, weights=areas[on]))
    point = np.average(middles, axis=0, weights=areas) if near is None else near
    return floor_frame(normal, offset, point)


def _level(
    corners: Float64[np.ndarray, "faces 3 3"],
) -> tuple[
    Bool[np.ndarray, " faces"], Float64[np.ndarray, " level"], Float64[np.ndarray, " level"]
]:
    """Which triangles look up, their areas, and their heights."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    level = normal[:, 2] > np.cos(LEVEL) * np.maximum(length, 1e-12)
    return level, length[level] / 2, corners[level].mean(axis=1)[:, 2]


def _lowest_peak(
    areas: Float64[np.ndarray, " level"], height: Float64[np.ndarray, " level"]
) -> float | None:
    """The height of the lowest level surface that is wide."""
    if len(areas) == 0:
        return None
    number = np.floor((height - height.min()) / _BIN).astype(np.int64)
    wide = np.convolve(np.bincount(number, areas), np.ones(3), mode="same")
    first = int(np.flatnonzero(wide >= _LOWEST * wide.max())[0])
    # From the first height that has enough, up to where there is the most of the same surface.
    while first + 1 < len(wide) and wide[first + 1] > wide[first]:
        first += 1
    return float(height.min() + (first + 0.5) * _BIN)


def _plane(
    points: Float64[np.ndarray, "points 3"], weights: Float64[np.ndarray, " points"]
) -> Float64[np.ndarray, "3"]:
    """The unit normal, upwards, of the plane through points."""
    off = points - np.average(points, axis=0, weights=weights)
    normal = np.linalg.eigh((off * weights[:, None]).T @ off)[1][:, 0]
    return normal * np.sign(normal[2] or 1.0)
