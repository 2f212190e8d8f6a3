"""Signed distance to an object's surface, on a grid that is computed once per object.

Made for raw scans. How far is the exact distance to the triangles; which side is the generalised
winding number (Jacobson et al. 2013, Barill et al. 2018), which holes, noise and double sheets only
blur. A part has an inside where it is closed; an open sheet has none.
"""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np
import torch
import trimesh
from jaxtyping import Float, Int
from scipy.ndimage import zoom
from torch import Tensor
from torch.nn.functional import grid_sample, normalize

from omomo_core.motion import ObjectMesh

MARGIN = 0.15
"""Metres of grid at least around the object."""
FINEST, COARSEST = 0.008, 0.025
"""Metres between grid points: parts thinner than that are met, but have no depth."""
GRID_POINTS = 400_000
"""What a grid is made of between these limits: about 0.4 s of one core."""
_STRIDE = 3
"""Away from the surface every third grid point is measured and the others lie between."""
_BAND = 1.25
"""How near is near, in those wider steps."""


@dataclass(frozen=True)
class DistanceField:
    """Signed distance to a surface, negative inside, on a regular grid: object's frame, metres."""

    low: Float[Tensor, "3"]
    """The grid's first point."""
    spacing: float
    """Between neighbouring grid points."""
    values: Float[Tensor, "x y z"]

    @property
    def high(self) -> Float[Tensor, "3"]:
        """The grid's last point."""
        return self.low + self.spacing * (torch.tensor(self.values.shape) - 1)

    def at(self, points: Float[Tensor, "*b 3"]) -> Float[Tensor, "*b"]:
        """Signed distance of points in the object's frame, metres.

        Trilinear between grid points. Beyond the grid it is a lower bound of the distance.
        """
        distance = self._sampled(self._volume[:1], points)
        return _reaching(distance, self._beyond(points))[..., 0]

    def away(self, points: Float[Tensor, "*b 3"]) -> Float[Tensor, "*b 3"]:
        """Unit direction in which the distance grows fastest: out of the object, object's frame.

        Zero where there is none: as far from one side as from the other.
        """
        return self.at_and_away(points)[1]

    def at_and_away(
        self, points: Float[Tensor, "*b 3"]
    ) -> tuple[Float[Tensor, "*b"], Float[Tensor, "*b 3"]]:
        """`at` and `away` of the same points, cheaper than one after the other."""
        distance, slope = self._sampled(self._volume, points).split([1, 3], dim=-1)
        beyond, away = self._beyond(points), normalize(slope, dim=-1)
        if beyond.any():
            inside = (beyond == 0).all(dim=-1, keepdim=True)
            away = torch.where(inside, away, normalize(distance * away + beyond, dim=-1))
        return _reaching(distance, beyond)[..., 0], away

    def _beyond(self, points: Float[Tensor, "*b 3"]) -> Float[Tensor, "*b 3"]:
        """The way from the nearest place in the grid to a point, metres."""
        points = points.to(self.values)
        return points - points.clamp(self.low, self.high)

    @cached_property
    def _volume(self) -> Float[Tensor, "4 z y x"]:
        """The distance and its slope (central differences), the axes as `grid_sample` wants them."""
        slope = torch.gradient(self.values, spacing=self.spacing)
        return torch.stack([self.values, *slope]).permute(0, 3, 2, 1).contiguous()

    def _sampled(
        self, volume: Float[Tensor, "channels z y x"], points: Float[Tensor, "*b 3"]
    ) -> Float[Tensor, "*b channels"]:
        """Trilinear values at points, those beyond the grid at the nearest place in it."""
        scale = 2 / (self.high - self.low)
        at = torch.addcmul(-1 - scale * self.low, points.to(self.values).reshape(-1, 3), scale)
        found = grid_sample(
            volume[None], at[None, None, None], padding_mode="border", align_corners=True
        )
        return found[0, :, 0, 0].T.reshape(*points.shape[:-1], len(volume))


def _reaching(
    distance: Float[Tensor, "*b 1"], beyond: Float[Tensor, "*b 3"]
) -> Float[Tensor, "*b 1"]:
    """Distance from a way beyond the grid, at least: the object is all on the other side of a plane."""
    if not beyond.any():
        return distance
    far = beyond.norm(dim=-1, keepdim=True)
    return torch.where(far > 0, torch.hypot(distance, far), distance)


def distance_field(mesh: ObjectMesh, *, spacing: float | None = None) -> DistanceField:
    """Measure the distance to a mesh on a grid around it.

    Args:
        mesh: a scan or a model; it may have holes, loose pieces, faces wound the wrong way here and
            there or altogether.
        spacing: metres between grid points; by default as fine as GRID_POINTS of them allow.
    """
    size = np.ptp(mesh.vertices, axis=0) + 2 * MARGIN
    if spacing is None:
        spacing = float(np.cbrt(np.prod(size) / GRID_POINTS).clip(FINEST, COARSEST))
    wide = np.ceil(size / (_STRIDE * spacing)).astype(int)
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    low = middle - wide * _STRIDE * spacing / 2
    counts = [range(_STRIDE * n + 1) for n in wide]
    points = low + spacing * np.stack(np.meshgrid(*counts, indexing="ij"), axis=-1)
    return DistanceField(
        low=torch.from_numpy(low).float(),
        spacing=spacing,
        values=torch.from_numpy(_measured(_tidy(mesh), points)).float(),
    )


def _measured(
    mesh: trimesh.Trimesh, points: Float[np.ndarray, "x y z 3"]
) -> Float[np.ndarray, "x y z"]:
    """Signed distances of a grid: exact near the surface, interpolated in the empty rest."""
    step = slice(None, None, _STRIDE)
    wide = points[step, step, step]
    coarse = _signed(mesh, wide.reshape(-1, 3)).reshape(wide.shape[:3])
    values = np.asarray(zoom(coarse, np.divide(points.shape[:3], coarse.shape), order=1))
    near = np.abs(values) < _BAND * float(np.linalg.norm(wide[0, 0, 0] - wide[0, 0, 1]))
    values[near] = _signed(mesh, points[near])
    return values


def _signed(
    mesh: trimesh.Trimesh, points: Float[np.ndarray, "points 3"]
) -> Float[np.ndarray, " points"]:
    """Distance to the triangles, negative where the surface winds around a point either way."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    distance = np.asarray(igl.signed_distance(points, vertices, faces, sign_type=kind)[0])
    turns = igl.fast_winding_number(vertices, faces, points)
    return np.where(np.abs(turns) > 0.5, -distance, distance)


def _tidy(mesh: ObjectMesh) -> trimesh.Trimesh:
    """The mesh with equal vertices merged, repeated faces left out, and faces wound alike."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    solid.update_faces(solid.unique_faces() & solid.nondegenerate_faces())
    return trimesh.Trimesh(solid.vertices, _wound_alike(solid), process=False)


def _wound_alike(mesh: trimesh.Trimesh) -> Int[np.ndarray, "faces 3"]:
    """Faces of each connected piece wound as most of its area is."""
    faces = np.asarray(mesh.faces)
    wound, piece = (np.asarray(found).astype(np.int64) for found in igl.bfs_orient(faces))
    agrees = (wound == faces).all(axis=1)
    vote = np.bincount(piece, weights=np.where(agrees, mesh.area_faces, -mesh.area_faces))
    return np.where((vote < 0)[piece, None], wound[:, ::-1], wound)
