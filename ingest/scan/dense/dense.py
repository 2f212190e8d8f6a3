"""The dense stage: a surface from registered pictures, mirrored where the object is symmetric.

The plane is found on what was seen: mirrored, seen surface must fall on seen surface or on what no
picture shows, and not into air that pictures show.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8
from scipy.ndimage import distance_transform_edt
from scipy.optimize import minimize
from scipy.spatial import KDTree

from ingest.scan.clean_mesh import main_piece
from ingest.scan.dense.depth_maps import Depths
from ingest.scan.dense.visual_hull import SURE, Evidence, Mask, gather_evidence
from ingest.scan.dense.volume import Box, coloured, seen_at, solid_surface
from ingest.scan.scan_types import Progress, Region, no_progress
from omomo_core.errors import InputError

_POINTS = 2500
"""Most points of the seen surface that are mirrored."""
_CELL = 0.01
"""Cell of the grid in which planes are first compared, metres."""
_TURN = np.radians(4.0)
"""Angle between the planes that are tried, radians."""
_AWAY = 0.3
"""Largest distance of a plane from the object's middle, in sizes of the object."""
_ON, _OFF = 0.012, 0.025
"""Metres from the surface up to which a mirrored point lies on it, and from which in air it is wrong."""
_AGREES, _SUPPORT = 0.85, 0.35
"""Least share of mirrored points that are right, among those that can be wrong, and among all."""
_SEED = 5


@dataclass(frozen=True)
class Mirror:
    """A plane of symmetry."""

    reflection: Float64[np.ndarray, "4 4"]
    """Reflection of points in the floor's frame; it is its own inverse."""
    agrees: float
    """Part of the seen surface whose mirror image is seen surface, where it could be seen to be not."""
    support: float
    """Part of the seen surface whose mirror image is seen surface."""

    def larger(self, factor: float) -> "Mirror":
        """The plane of an object that is larger by a factor."""
        reflection = self.reflection.copy()
        reflection[:3, 3] *= factor
        return Mirror(reflection, self.agrees, self.support)


def find_mirror(evidence: Evidence, points: Float64[np.ndarray, "verts 3"]) -> Mirror | None:
    """The plane of symmetry, or None where the object has none or shows too little of both halves.

    Args:
        evidence: of the region.
        points: vertices of the seen surface, floor's frame, metres.
    """
    if len(points) < _POINTS // 5:
        return None
    pick = np.random.default_rng(_SEED).permutation(len(points))[:_POINTS]
    chosen = points[pick]
    compared = _Compared(evidence, points)
    middle = (points.min(axis=0) + points.max(axis=0))[:2] / 2
    reach = _AWAY * float(np.ptp(points[:, :2], axis=0).max())
    best, right = (0.0, 0.0), -1.0
    for turn in np.arange(0.0, np.pi, _TURN):
        offset = float(middle @ [np.cos(turn), np.sin(turn)])
        for away in np.arange(-reach, reach, _CELL):
            score = compared.score(mirrored(chosen, turn, offset + away))
            if score > right:
                best, right = (float(turn), offset + float(away)), score
    turn, offset = _refined(chosen, KDTree(points), best)
    agrees, support = compared.shares(mirrored(chosen, turn, offset))
    if agrees < _AGREES or support < _SUPPORT:
        return None
    return Mirror(_reflection(turn, offset), agrees, support)


class _Compared:
    """Grids that tell how far from the seen surface places are, and which are air."""

    def __init__(self, evidence: Evidence, points: Float64[np.ndarray, "verts 3"]) -> None:
        box = evidence.box
        self._low = box.low
        step = max(1, round(_CELL / box.voxel))
        self._cell = step * box.voxel
        air = evidence.field[::step, ::step, ::step] > 0.5
        on = np.zeros(air.shape, np.bool_)
        on[self._places(points, air.shape)] = True
        self._away = (np.asarray(distance_transform_edt(~on)) * self._cell).astype(np.float32)
        self._air = air

    def _places(self, points: Float64[np.ndarray, "n 3"], shape: tuple[int, ...]) -> tuple:
        grid = np.rint((points - self._low) / self._cell).astype(int)[:, ::-1]
        return tuple(grid.clip(0, np.array(shape) - 1).T)

    def shares(self, points: Float64[np.ndarray, "n 3"]) -> tuple[float, float]:
        """Parts of the points on the surface: of those there or in air, and of all."""
        at = self._places(points, self._air.shape)
        on = self._away[at] < _ON
        wrong = self._air[at] & (self._away[at] > _OFF)
        return float(on.sum() / max(1, (on | wrong).sum())), float(on.mean())

    def score(self, points: Float64[np.ndarray, "n 3"]) -> float:
        """Larger for better planes."""
        agrees, support = self.shares(points)
        return support - 2 * (1 - agrees)


def mirrored(
    points: Float64[np.ndarray, "n 3"], turn: float, offset: float
) -> Float64[np.ndarray, "n 3"]:
    """Points reflected at the upright plane whose normal is turned so far from x."""
    normal = np.array([np.cos(turn), np.sin(turn), 0.0])
    return points - 2 * (points @ normal - offset)[:, None] * normal


def _reflection(turn: float, offset: float) -> Float64[np.ndarray, "4 4"]:
    normal = np.array([np.cos(turn), np.sin(turn), 0.0])
    T = np.eye(4)
    T[:3, :3] -= 2 * np.outer(normal, normal)
    T[:3, 3] = 2 * offset * normal
    return T


def _refined(
    points: Float64[np.ndarray, "n 3"], surface: KDTree, start: tuple[float, float]
) -> tuple[float, float]:
    """The plane that lays the points best on the surface, those that are far off counting alike."""

    def off(plane: Float64[np.ndarray, "2"]) -> float:
        away = surface.query(mirrored(points, plane[0], plane[1]), distance_upper_bound=_OFF)[0]
        return float(np.minimum(away, _OFF).mean())

    simplex = np.array(start) + np.array([[0.0, 0.0], [_TURN / 2, 0.0], [0.0, _CELL]])
    found = minimize(
        off, start, method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": 80}
    )
    return float(found.x[0]), float(found.x[1])


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
    evidence = gather_evidence(depths, masks, region, box, band, progress)
    vertices, faces = _surface(evidence)
    seen = seen_at(vertices, evidence.seen, box, SURE)
    mirror = _mirror(evidence, vertices, faces, seen) if symmetry else None
    if mirror is not None:
        evidence = gather_evidence(depths, masks, region, box, band, progress, mirror.reflection)
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
