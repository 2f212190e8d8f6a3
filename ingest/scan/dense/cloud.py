"""cloud: places where depth maps show a surface, thin parts that have no corners among them."""

import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int64

from ingest.scan.dense.depth_map import pixel_rays
from ingest.scan.dense.depths import Depths
from ingest.scan.dense.picture import at_pixels, matrix_for, projected
from ingest.scan.region.aim import Aim

_SPACING = 0.02
"""Metres between places."""
_FEWEST = 3
"""Views that must see a surface at a place."""
_NEAR = 0.03
"""Metres from it in which they must see it."""
_SHARE = 0.4
"""The part that they are of all views that see something there or look through it."""


def cloud(depths: Depths, aim: Aim) -> Float64[np.ndarray, "places 3"]:
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
    places = np.stack(np.unravel_index(cubes[views >= _FEWEST], (side,) * 3), axis=1)
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
    return (seen >= _FEWEST) & (seen >= _SHARE * (seen + through))
