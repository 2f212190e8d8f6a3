"""dense_surface: the closed surface of what is in a region, with its colours."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8

from ingest.scan.clean.pieces import main_piece
from ingest.scan.dense.colours import coloured
from ingest.scan.dense.depths import Depths
from ingest.scan.dense.evidence import SURE, Evidence, Mask, gather
from ingest.scan.dense.surface import seen_at, solid_surface
from ingest.scan.dense.symmetry import Mirror, find_mirror
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
    mirror: Mirror | None = None
    """The object's plane of symmetry, where its halves were joined; in the floor's frame."""


def dense_surface(
    depths: Depths,
    region: Region,
    *,
    masks: Sequence[Mask | None] | None = None,
    symmetry: bool = False,
    voxel: float | None = None,
    progress: Progress = no_progress,
) -> DenseSurface:
    """Join what all views measured in a region.

    Args:
        depths: of the views.
        region: what is measured.
        masks: silhouettes of the views, of `find_silhouettes`, where they are known.
        symmetry: let each half of an object that has a plane of symmetry show what the other hides.
        voxel: metres between the places that are measured; by default what the memory allows.
        progress: called with the stages "fusion" and "colours".

    Raises:
        InputError: "scan-no-surface", or "scan-picture".
    """
    masks = masks or [None] * len(depths.pictures.views)
    size = region.high - region.low
    voxel = voxel or float(np.cbrt(np.prod(size) / _VOXELS).clip(_FINEST, _COARSEST))
    box, band = Box.of(region.low, region.high, voxel), max(_BAND * voxel, _LEAST_BAND)
    evidence = gather(depths, masks, region, box, band, progress)
    vertices, faces = _surface(evidence)
    seen = seen_at(vertices, evidence.seen, box, SURE)
    mirror = _mirror(evidence, vertices, faces, seen) if symmetry else None
    if mirror is not None:
        evidence = gather(depths, masks, region, box, band, progress, mirror.reflection)
        vertices, faces = _surface(evidence)
        seen = seen_at(vertices, evidence.seen, box, SURE)
    T = region.T_world_floor
    vertices = vertices @ T[:3, :3].T + T[:3, 3]
    progress("colours", 0.0)
    colours = coloured(vertices, faces, depths.pictures, depths.kinds[0])
    progress("colours", 1.0)
    return DenseSurface(vertices, faces, colours, seen, voxel, depths.method, mirror)


def _surface(
    evidence: Evidence,
) -> tuple[Float64[np.ndarray, "verts 3"], Int64[np.ndarray, "faces 3"]]:
    """Vertices in the floor's frame, and faces; never next to none."""
    vertices, faces = solid_surface(evidence.field.copy(), evidence.box)
    if len(faces) < _FEWEST_FACES:
        raise InputError(
            "scan-no-surface",
            "No surface was found where the object should be.",
            fix="Film it closer and all around, in more light; stick some tape or paper with a "
            "pattern on it if it is plain.",
        )
    return vertices, faces


def _mirror(
    evidence: Evidence,
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    seen: Bool[np.ndarray, " verts"],
) -> Mirror | None:
    """The plane of symmetry of what is not a crumb."""
    kept = np.zeros(len(vertices), np.bool_)
    kept[faces[main_piece(vertices, faces)]] = True
    return find_mirror(evidence, vertices[seen & kept])
