"""Evidence: what depth and silhouettes together say about every place around an object."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8
from scipy.ndimage import binary_dilation, uniform_filter

from ingest.scan.dense.depth_map import DepthMap, pixel_rays
from ingest.scan.dense.depths import Depths
from ingest.scan.dense.openness import open_places
from ingest.scan.dense.picture import matrix_for
from ingest.scan.dense.thin import BAR, thin_parts
from ingest.scan.dense.visual_hull import VisualHull
from ingest.scan.dense.volume import Box, Volume, grounded
from ingest.scan.types import Progress, Region
from omomo_core.geometry.transforms import inverse

SURE = 2.0
"""Views that must have seen a surface before it counts as seen."""
_LOW = 0.015
"""Metres above the floor below which depth in a silhouette is the floor's."""
_THROUGH = 0.5
"""Pictures that must back a place, as a share of those that see through it."""
_WITHIN = 0.8
"""Voxels inside the outlines from which on a place is well inside."""
_FIRM = 4.0
"""Views that must agree about a surface before it counts although it lies outside of silhouettes."""
_HALF = 0.5
"""Largest share of the pictures that may see through a thin part."""
_SHOWN = 0.2
"""Least share of pictures that show a thin part, among those and the ones with something before it."""
_FOOT = 0.045
"""Metres above the floor below which feet look like floor, because they never leave their place."""
_ASYMMETRY = 0.01
"""Metres by which the halves of a symmetric object may differ."""
_OUTLINE = 1.5
"""Voxels from an outline within which it shows the surface of a backed place."""

Mask = UInt8[np.ndarray, "h w"]
Grid = Float32[np.ndarray, "z y x"]


@dataclass(frozen=True)
class Evidence:
    """A field of the region, and how often its surface was seen."""

    box: Box
    field: Grid
    """Below 0 in what is solid, above it in what is empty."""
    seen: Grid
    """Views that show a surface at each place, by depth or by outline."""


def gather(
    depths: Depths,
    masks: Sequence[Mask | None],
    region: Region,
    box: Box,
    band: float,
    progress: Progress,
    mirror: Float64[np.ndarray, "4 4"] | None = None,
) -> Evidence:
    """Join depth maps and silhouettes.

    Args:
        depths: of the views.
        masks: silhouettes of the same views, where they are known.
        region, box: where, and in which voxels.
        band: metres in front of a surface and behind it that its depth speaks of.
        progress: called with the stage "fusion".
        mirror: reflection at the object's plane of symmetry; every view then counts as another one
            of the mirrored object too.
    """
    volume = Volume(box, band)
    hull = VisualHull(box, sum(mask is not None for mask in masks))
    ways = [(np.eye(4), 0.0)] if mirror is None else [(np.eye(4), 0.0), (mirror, _ASYMMETRY)]
    views = depths.pictures.views
    for index, (view, mask) in enumerate(zip(views, masks, strict=True)):
        T = inverse(view.T_world_camera) @ region.T_world_floor
        maps = [kind[index] for kind in depths.kinds]
        if mask is not None:
            matrix = matrix_for(view, mask.shape[::-1])
            maps = [_own(depth, mask, matrix, T, region) for depth in maps]
            for way, doubt in ways:
                hull.add(mask, _nearest(maps, mask), matrix, T @ way, doubt)
        for depth in maps:
            for way, _ in ways:
                volume.add(depth, matrix_for(view, depth.shape[::-1]), T @ way)
        progress("fusion", (index + 1) / len(views))
    if not any(mask is not None for mask in masks):
        return Evidence(box, grounded(volume.field(), box), volume.seen())
    return _joined(volume, hull)


def _joined(volume: Volume, hull: VisualHull) -> Evidence:
    """Solid is what depth and silhouettes both allow; what depth does not know, silhouettes decide."""
    box, outside = volume.box, hull.outside()
    rim = (outside / np.float32(volume.band)).clip(-1, 1)
    seen = volume.seen()
    free, within = volume.free(), outside < -_WITHIN * box.voxel
    # Well inside the outlines, who sees the background where others see a surface has missed a bar.
    missed = np.maximum(free - seen - hull.backing(), np.float32(0))
    field, unseen = volume.judged(np.where(within, missed, free))
    backed = _most(hull.backed(_THROUGH * volume.free()) | _thin(volume, hull))
    surface = (seen >= SURE) & (np.abs(field) < 1) & (outside < box.voxel)
    hidden = unseen & (outside < 0) & ~backed
    field[open_places(hidden, surface | backed, box.voxel)] = 1.0
    # Near an outline depth is finer than the outline; well inside of it, views look through bars.
    doubted = (volume.free() > seen) & within
    poor = backed & ((seen < SURE) | doubted)
    field[poor] = np.minimum(field[poor], rim[poor])
    # Depth that many views agree about, and none looks through, knows better than an outline.
    firm = (seen >= _FIRM) & (seen > volume.free())
    np.maximum(field, np.where(firm, np.float32(-1), rim), out=field)
    beside = np.asarray(binary_dilation(backed, iterations=2), np.bool_)
    near = beside & (np.abs(outside) < _OUTLINE * box.voxel)
    seen = np.where(near, np.maximum(seen, np.float32(SURE)), seen)
    return Evidence(box, grounded(field, box, _FOOT), seen)


def _most(places: Bool[np.ndarray, "z y x"]) -> Bool[np.ndarray, "z y x"]:
    """Places with most of those around them: single ones are noise."""
    around = np.asarray(uniform_filter(places.astype(np.float32), 3, mode="nearest"))
    return places & (around > 0.5)


def _thin(volume: Volume, hull: VisualHull) -> Bool[np.ndarray, "z y x"]:
    """Parts of the hull too thin for depth, which enough pictures show with nothing before them."""
    seen, free = volume.seen(), volume.free()
    shown = seen + hull.backing()
    asked = shown + hull.hidden()
    return (
        thin_parts(hull.outside() < 0, volume.box.voxel, BAR)
        & (free < _HALF * (free + asked))
        & (shown >= _SHOWN * asked)
    )


def _own(
    depth: Float32[np.ndarray, "rows columns"],
    mask: Mask,
    matrix: Float64[np.ndarray, "3 3"],
    T_camera_floor: Float64[np.ndarray, "4 4"],
    region: Region,
) -> DepthMap:
    """Depth of the mask's size, without what it says of the background where that shows the object."""
    large = cv2.resize(depth, mask.shape[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
    T = inverse(T_camera_floor).astype(np.float32)
    places = (pixel_rays(large.shape, matrix) * large[..., None]) @ T[:3, :3].T + T[:3, 3]
    low = region.low + np.array([0.0, 0.0, _LOW])
    there = ((places > low) & (places < region.high)).all(axis=-1)
    return np.where((mask == 1) & ~there, np.float32(0), large)


def _nearest(maps: Sequence[DepthMap], mask: Mask) -> DepthMap:
    """The nearest depth of all that are known in each pixel of a mask; 0 where none is."""
    nearest = np.full(mask.shape, np.inf, np.float32)
    for depth in maps:
        np.minimum(nearest, np.where(depth > 0, depth, np.inf), out=nearest)
    known: Bool[np.ndarray, "h w"] = np.isfinite(nearest) & (mask == 1)
    return np.where(known, nearest, 0).astype(np.float32)
