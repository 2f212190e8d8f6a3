"""Depth maps of all views, by stereo and LiDAR, and the points that they agree on."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from ingest.formats.still_images import load_millimetres
from ingest.scan.dense.stereo import (
    DepthMap,
    DepthMaps,
    SmallPictures,
    at_pixels,
    matrix_for,
    pixel_rays,
    projected,
    stereo_maps,
)
from ingest.scan.region import Aim
from ingest.scan.scan_choices import WHOLE, Measured
from ingest.scan.scan_types import Progress, Registered, View, no_progress
from omomo_core.errors import InputError

_MIXED = 0.06
"""Part of the depth by which neighbouring pixels differ at an edge."""
_FEWEST_POINTS = 100
"""Fewest sparse points with depth from which the depth's scale is taken."""


@dataclass(frozen=True)
class Depths:
    """Depth maps of all views, and by what they were measured."""

    pictures: SmallPictures
    """Pictures of the views, as they were matched."""
    kinds: tuple[DepthMaps, ...]
    """Maps of each way of measuring, one for each view (0 where unknown), at least one way."""
    method: Literal["stereo", "depth", "both"]


def measure_depths(
    registered: Registered,
    aim: Aim,
    work: Path,
    *,
    method: Measured = "auto",
    width: int = WHOLE.matched,
    room: DepthMaps | None = None,
    progress: Progress = no_progress,
) -> Depths:
    """Measure the depth of each view.

    Args:
        registered: cameras and sparse points.
        aim: where the cameras look.
        work: folder that keeps what is slow to measure.
        method: "stereo" matches pictures, "depth" takes the phone's LiDAR; "auto" both where there
            is depth.
        width: of the pictures that are matched, pixels.
        room: more depth maps, of `room_depth`; they join whatever the method is.
        progress: called with the stage "stereo".

    Raises:
        InputError: "scan-no-depth" (asked for, and there is none), or "scan-picture".
    """
    chosen = _chosen(method, registered.views)
    pictures = SmallPictures(registered.views, width)
    kinds: list[DepthMaps] = []
    if chosen != "depth":
        kinds.append(stereo_maps(registered, pictures, aim, work, progress))
    if chosen != "stereo":
        kinds.append(_in_world_metres(registered, [_lidar(view) for view in registered.views]))
    if room is not None:
        kinds.append(_in_world_metres(registered, room))
    return Depths(pictures, tuple(kinds), chosen)


def _chosen(method: Measured, views: Sequence[View]) -> Literal["stereo", "depth", "both"]:
    has_depth = any(view.depth for view in views)
    if method == "auto":
        return "both" if has_depth else "stereo"
    if method != "stereo" and not has_depth:
        raise InputError(
            "scan-no-depth",
            "The scan has no depth maps.",
            fix="Scan with an iPhone Pro and an app that saves depth, or leave the method to auto.",
        )
    return method


def _lidar(view: View) -> DepthMap:
    """The phone's depth, without the pixels at edges that mix what is before and behind."""
    if view.depth is None:
        return np.zeros((1, 1), np.float32)
    depth = load_millimetres(view.depth)
    around = np.ones((3, 3), np.uint8)
    nearest, farthest = cv2.erode(depth, around), cv2.dilate(depth, around)
    return np.where(farthest - nearest > _MIXED * depth, np.float32(0), depth)


def _in_world_metres(registered: Registered, maps: DepthMaps) -> DepthMaps:
    """Depth maps in the metres of the cameras' world; depth of a phone may be some percent longer.

    Where both are joined, a difference of sizes doubles every surface.
    """
    ratios = [
        sparse_ratios(registered, index, depth)
        for index, depth in enumerate(maps)
        if depth.size > 1
    ]
    found = np.concatenate([np.empty(0, np.float32), *ratios])
    if len(found) < _FEWEST_POINTS:
        return maps
    factor = np.float32(np.median(found))
    return [depth * factor for depth in maps]


def sparse_ratios(
    registered: Registered, index: int, depth: DepthMap
) -> Float32[np.ndarray, " points"]:
    """Depth of a view's sparse points over what its depth map says."""
    view = registered.views[index]
    points = registered.points[registered.observed[registered.observed[:, 1] == index, 0]]
    u, v, z = projected(points, view.T_world_camera, matrix_for(view, depth.shape[::-1]))
    shown = at_pixels(depth, u, v, cv2.INTER_NEAREST)
    return z[shown > 0] / shown[shown > 0]


_SPACING = 0.02
"""Metres from one place to the next."""
_FEWEST_VIEWS = 3
"""Views that must see a surface at a place."""
_NEAR = 0.03
"""Metres from a place within which they must see the surface."""
_SHARE = 0.4
"""Least share of these views among all that see something there or look through it."""


def surface_points(depths: Depths, aim: Aim) -> Float64[np.ndarray, "places 3"]:
    """Middles of cubes within the cameras' distance of the aim in which views see a surface.

    What one view sees and others look through is a mistake of matching.

    Returns:
        World, metres.
    """
    half = int(np.ceil(aim.distance / _SPACING))
    side = 2 * half + 1
    seen = [
        _cubes(depths, view, aim.point - (half + 0.5) * _SPACING, side)
        for view in range(len(depths.pictures.views))
    ]
    cubes, views = np.unique(np.concatenate(seen), return_counts=True)
    places = np.stack(np.unravel_index(cubes[views >= _FEWEST_VIEWS], (side,) * 3), axis=1)
    points = aim.point + (places - half) * _SPACING
    return points[_solid(depths, points)]


def _cubes(
    depths: Depths, index: int, low: Float64[np.ndarray, "3"], side: int
) -> Int64[np.ndarray, " cubes"]:
    """Numbers of the cubes in which a view sees something, each once."""
    view = depths.pictures.views[index]
    found: list[Int64[np.ndarray, " cubes"]] = []
    for maps in depths.kinds:
        depth = maps[index]
        rays = pixel_rays(depth.shape, matrix_for(view, depth.shape[::-1]))
        points = (rays * depth[..., None])[depth > 0]
        T = view.T_world_camera
        cubes = np.floor((points @ T[:3, :3].T + T[:3, 3] - low) / _SPACING).astype(np.int64)
        inside = ((cubes >= 0) & (cubes < side)).all(axis=1)
        found.append(cubes[inside] @ np.array([side * side, side, 1]))
    return np.unique(np.concatenate(found))


def _solid(depths: Depths, points: Float64[np.ndarray, "places 3"]) -> Bool[np.ndarray, " places"]:
    """Which places enough of the views see, of those that do not see something before them."""
    seen, through = np.zeros(len(points), int), np.zeros(len(points), int)
    for maps in depths.kinds:
        for view, depth in zip(depths.pictures.views, maps, strict=True):
            matrix = matrix_for(view, depth.shape[::-1])
            u, v, z = projected(points, view.T_world_camera, matrix)
            shown = at_pixels(depth, u, v, cv2.INTER_NEAREST)
            seen += (shown > 0) & (np.abs(shown - z) < _NEAR)
            through += shown > z + _NEAR
    return (seen >= _FEWEST_VIEWS) & (seen >= _SHARE * (seen + through))
