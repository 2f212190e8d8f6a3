"""dense_surface: the closed surface of what is in a region, with its colours."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8

from ingest.formats.depth_png import load_millimetres
from ingest.scan.dense.colours import coloured
from ingest.scan.dense.depth_map import DepthMap
from ingest.scan.dense.picture import SmallPictures, matrix_for
from ingest.scan.dense.stereo import stereo_maps
from ingest.scan.dense.surface import seen_at, solid_surface
from ingest.scan.dense.volume import Box, Volume
from ingest.scan.region.aim import Aim
from ingest.scan.types import Progress, Region, Registered, View, no_progress
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

Method = Literal["auto", "stereo", "depth", "both"]
_WIDTH = 480
"""Pixels of the pictures that are matched."""
_VOXELS = 8_000_000
"""About; each needs some 30 bytes."""
_FINEST, _COARSEST = 0.0025, 0.012
"""Metres between voxels."""
_BAND = 3.0
"""Voxels, and at least as many metres as follow."""
_LEAST_BAND = 0.012
_SURE = 2.0
"""Views that must have seen a surface before it counts as seen."""
_FEWEST_FACES = 100


@dataclass(frozen=True)
class DenseSurface:
    """What was measured, before it is cleaned; world, metres."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int64[np.ndarray, "faces 3"]
    """Wound to look outwards; the surface is closed."""
    colours: UInt8[np.ndarray, "verts 3"]
    seen: Bool[np.ndarray, " verts"]
    """False where the surface only closes what no picture shows."""
    voxel: float
    """Metres: no detail is finer."""
    method: Literal["stereo", "depth", "both"]


@dataclass(frozen=True)
class _Source:
    """Depth maps of one kind, one for each view (empty where there is none)."""

    maps: Sequence[DepthMap]
    weight: float


def dense_surface(
    registered: Registered,
    region: Region,
    aim: Aim,
    work: Path,
    *,
    method: Method = "auto",
    voxel: float | None = None,
    progress: Progress = no_progress,
) -> DenseSurface:
    """Measure the surface in a region.

    Args:
        registered: cameras and sparse points.
        region: what is measured.
        aim: where the cameras look.
        work: folder that keeps what is slow to measure.
        method: "stereo" matches pictures, "depth" takes the phone's LiDAR; "auto" both where there
            is depth.
        voxel: metres between the places that are measured; by default what the memory allows.
        progress: told of the stages "stereo", "fusion" and "colours".

    Raises:
        InputError: "scan-no-depth" (asked for, and there is none), "scan-picture", or
            "scan-no-surface".
    """
    chosen = _chosen(method, registered.views)
    pictures = SmallPictures(registered.views, _WIDTH)
    sources: list[_Source] = []
    if chosen != "depth":
        sources.append(_Source(stereo_maps(registered, pictures, aim, work, progress), 1.0))
    if chosen != "stereo":
        sources.append(_Source([_lidar(view) for view in registered.views], 1.0))
    volume = _filled(registered.views, region, sources, voxel, progress)
    vertices, faces = solid_surface(volume)
    if len(faces) < _FEWEST_FACES:
        raise InputError(
            "scan-no-surface",
            "No surface was found where the object should be.",
            fix="Film it closer and all around, in more light; stick some tape or paper with a "
            "pattern on it if it is plain.",
        )
    seen = seen_at(vertices, volume, _SURE)
    T = region.T_world_floor
    vertices = vertices @ T[:3, :3].T + T[:3, 3]
    progress("colours", 0.0)
    colours = coloured(vertices, faces, pictures, sources[0].maps)
    progress("colours", 1.0)
    return DenseSurface(vertices, faces, colours, seen, volume.box.voxel, chosen)


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


def _filled(
    views: Sequence[View],
    region: Region,
    sources: Sequence[_Source],
    voxel: float | None,
    progress: Progress,
) -> Volume:
    """The region as all the views see it."""
    size = region.high - region.low
    voxel = voxel or float(np.cbrt(np.prod(size) / _VOXELS).clip(_FINEST, _COARSEST))
    volume = Volume(Box.of(region.low, region.high, voxel), max(_BAND * voxel, _LEAST_BAND))
    for index, view in enumerate(views):
        T_camera_floor = inverse(view.T_world_camera) @ region.T_world_floor
        for source in sources:
            depth = source.maps[index]
            volume.add(depth, matrix_for(view, depth.shape[::-1]), T_camera_floor, source.weight)
        progress("fusion", (index + 1) / len(views))
    return volume
