"""measure_depths: how far what each view shows is, by matching pictures, by LiDAR, or by both."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ingest.formats.depth_png import load_millimetres
from ingest.scan.choices import Method
from ingest.scan.dense.depth_map import DepthMap
from ingest.scan.dense.picture import SmallPictures
from ingest.scan.dense.stereo import stereo_maps
from ingest.scan.region.aim import Aim
from ingest.scan.types import Progress, Registered, View, no_progress
from omomo_core.errors import InputError

_WIDTH = 480
"""Pixels of the pictures that are matched."""


@dataclass(frozen=True)
class Depths:
    """Depth maps of all views, and by what they were measured."""

    pictures: SmallPictures
    """Of the views, as they were matched."""
    kinds: tuple[Sequence[DepthMap], ...]
    """For each way of measuring one map for each view (0 where unknown), at least one way."""
    method: Literal["stereo", "depth", "both"]


def measure_depths(
    registered: Registered,
    aim: Aim,
    work: Path,
    *,
    method: Method = "auto",
    progress: Progress = no_progress,
) -> Depths:
    """Measure the depth of each view.

    Args:
        registered: cameras and sparse points.
        aim: where the cameras look.
        work: folder that keeps what is slow to measure.
        method: "stereo" matches pictures, "depth" takes the phone's LiDAR; "auto" both where there
            is depth.
        progress: called with the stage "stereo".

    Raises:
        InputError: "scan-no-depth" (asked for, and there is none), or "scan-picture".
    """
    chosen = _chosen(method, registered.views)
    pictures = SmallPictures(registered.views, _WIDTH)
    kinds: list[Sequence[DepthMap]] = []
    if chosen != "depth":
        kinds.append(stereo_maps(registered, pictures, aim, work, progress))
    if chosen != "stereo":
        kinds.append([_lidar(view) for view in registered.views])
    return Depths(pictures, tuple(kinds), chosen)


def _chosen(method: Method, views: Sequence[View]) -> Literal["stereo", "depth", "both"]:
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
    return load_millimetres(view.depth) if view.depth else np.zeros((1, 1), np.float32)
