"""dense_surface: the closed surface of what is in a region, with its colours."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8

from ingest.scan.dense.colours import coloured
from ingest.scan.dense.depths import Depths
from ingest.scan.dense.evidence import SURE, Evidence, Mask, gather
from ingest.scan.dense.surface import seen_at, solid_surface
from ingest.scan.dense.volume import Box
from ingest.scan.types import Progress, Region, no_progress
from omomo_core.errors import InputError

_VOXELS = 8_000_000
"""About; each needs some 30 bytes."""
_FINEST, _COARSEST = 0.0025, 0.012
"""Metres between voxels."""
_BAND = 3.0
"""Voxels, and at least as many metres as follow."""
_LEAST_BAND = 0.012
_FEWEST_FACES = 100


@dataclass(frozen=True)
class DenseSurface:
    """The measured surface before it is cleaned; world, metres."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int64[np.ndarray, "faces 3"]
    """Wound to look outwards; the surface is closed."""
    colours: UInt8[np.ndarray, "verts 3"]
    seen: Bool[np.ndarray, " verts"]
    """False where the surface only closes what no picture shows."""
    voxel: float
    """Metres: no detail is finer."""
    method: Literal["stereo", "depth", "both"]


def dense_surface(
    depths: Depths,
    region: Region,
    *,
    masks: Sequence[Mask | None] | None = None,
    voxel: float | None = None,
    progress: Progress = no_progress,
) -> DenseSurface:
    """Join what all views measured in a region.

    Args:
        depths: of the views.
        region: what is measured.
        masks: silhouettes of the views, of `find_silhouettes`, where they are known.
        voxel: metres between the places that are measured; by default what the memory allows.
        progress: called with the stages "fusion" and "colours".

    Raises:
        InputError: "scan-no-surface", or "scan-picture".
    """
    evidence = _evidence(depths, masks, region, voxel, progress)
    vertices, faces = solid_surface(evidence.field, evidence.box)
    if len(faces) < _FEWEST_FACES:
        raise InputError(
            "scan-no-surface",
            "No surface was found where the object should be.",
            fix="Film it closer and all around, in more light; stick some tape or paper with a "
            "pattern on it if it is plain.",
        )
    seen = seen_at(vertices, evidence.seen, evidence.box, SURE)
    T = region.T_world_floor
    vertices = vertices @ T[:3, :3].T + T[:3, 3]
    progress("colours", 0.0)
    colours = coloured(vertices, faces, depths.pictures, depths.kinds[0])
    progress("colours", 1.0)
    return DenseSurface(vertices, faces, colours, seen, evidence.box.voxel, depths.method)


def _evidence(
    depths: Depths,
    masks: Sequence[Mask | None] | None,
    region: Region,
    voxel: float | None,
    progress: Progress,
) -> Evidence:
    """What all the views say about the region."""
    size = region.high - region.low
    voxel = voxel or float(np.cbrt(np.prod(size) / _VOXELS).clip(_FINEST, _COARSEST))
    box, band = Box.of(region.low, region.high, voxel), max(_BAND * voxel, _LEAST_BAND)
    return gather(depths, masks or [None] * len(depths.pictures.views), region, box, band, progress)
