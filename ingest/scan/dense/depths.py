"""measure_depths: how far what each view shows is, by matching pictures, by LiDAR, or by both."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float32

from ingest.formats.depth_png import load_millimetres
from ingest.scan.choices import WHOLE, Measured
from ingest.scan.dense.depth_map import DepthMap, DepthMaps
from ingest.scan.dense.picture import SmallPictures, at_pixels, matrix_for, projected
from ingest.scan.dense.stereo import stereo_maps
from ingest.scan.region.aim import Aim
from ingest.scan.types import Progress, Registered, View, no_progress
from omomo_core.errors import InputError

_MIXED = 0.06
"""Part of the depth by which neighbouring pixels differ at an edge."""
_FEWEST = 100
"""Fewest sparse points with depth from which the depth's scale is taken."""


@dataclass(frozen=True)
class Depths:
    """Depth maps of all views, and by what they were measured."""

    pictures: SmallPictures
    """Of the views, as they were matched."""
    kinds: tuple[DepthMaps, ...]
    """For each way of measuring one map for each view (0 where unknown), at least one way."""
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
        kinds.append(_laid_on(registered, [_lidar(view) for view in registered.views]))
    if room is not None:
        kinds.append(_laid_on(registered, room))
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


def _laid_on(registered: Registered, maps: DepthMaps) -> DepthMaps:
    """Depth maps in the length of the cameras' world: a phone's depth may be some percent longer.

    Where both are joined, a difference of sizes doubles every surface.
    """
    ratios = [
        sparse_ratios(registered, index, depth)
        for index, depth in enumerate(maps)
        if depth.size > 1
    ]
    found = np.concatenate([np.empty(0, np.float32), *ratios])
    if len(found) < _FEWEST:
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
