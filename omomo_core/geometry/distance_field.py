"""Signed distance to an object's surface, on a grid that is computed once per object.

Made for raw scans. How far is the exact distance to the triangles; which side is the generalised
winding number (Jacobson et al. 2013, Barill et al. 2018), which holes, noise and double sheets only
blur. A part has an inside where it is closed; an open sheet has none.
"""

from dataclasses import dataclass, field
from functools import cached_property

import igl
import numpy as np
import torch
import trimesh
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn.functional import grid_sample, interpolate, normalize

from omomo_core.errors import InputError
from omomo_core.geometry.geometry_config import DISTANCE_FIELD
from omomo_core.geometry.surface import Triangles
from omomo_core.motion import ObjectMesh


@dataclass(frozen=True)
class DistanceField:
    """Signed distance to a surface, negative inside, on a regular grid: object's frame, metres."""

    low: Float[Tensor, "3"]
    """The grid's first point."""
    spacing: float
    """Between neighbouring grid points."""
    values: Float[Tensor, "x y z"]
    sheet: "_Sheet | None" = field(default=None, repr=False, compare=False)
    """The surface itself; None where only the grid is known."""

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
        distance, slope = self._sampled(self._volume, points).split([1, 3], dim=-1)
        beyond, away = self._beyond(points), normalize(slope, dim=-1)
        if beyond.any():
            inside = (beyond == 0).all(dim=-1, keepdim=True)
            away = torch.where(inside, away, normalize(distance * away + beyond, dim=-1))
        return away

    def exact(
        self, points: Float[Tensor, "points 3"]
    ) -> tuple[Float[Tensor, " points"], Float[Tensor, "points 3"]]:
        """Signed distance to the surface itself, and the direction in which it grows; slow."""
        if self.sheet is None or not len(points):
            return self.at(points), self.away(points)
        found = points.double().numpy()
        distance, nearest = self.sheet.nearest(found)
        signed = torch.from_numpy(self._with_side(distance, found, self.sheet)).to(points)
        way = (points - torch.from_numpy(nearest).to(points)) * torch.sign(signed)[:, None]
        # On the surface itself there is no way to it.
        touching = torch.from_numpy(distance < DISTANCE_FIELD.touching)
        way[touching] += DISTANCE_FIELD.touching * self.away(points[touching])
        return signed, normalize(way, dim=-1)

    def fine(self, points: Float[Tensor, "*b 3"]) -> Float[Tensor, "*b"]:
        """Signed distance of points, metres: to the surface itself where they may be inside.

        The grid alone is too coarse for thin parts.
        """
        distance = self.at(points)
        near = distance < DISTANCE_FIELD.grid_error * self.spacing
        distance[near] = self.exact(points[near])[0]
        return distance

    def _with_side(
        self,
        distance: Float[np.ndarray, " points"],
        points: Float[np.ndarray, "points 3"],
        sheet: "_Sheet",
    ) -> Float[np.ndarray, " points"]:
        """Return signed distances of points whose distances to the surface are known.

        The surface does not pass between two points whose distances to it add up to more than the distance
        from one to the other. Most points have such a corner in their cell of the grid, and take its sign;
        the others, right at the surface, take that of the winding number, which costs more.
        """
        values, low = self.values.numpy(), self.low.double().numpy()
        place = (points - low) / self.spacing
        first = place.astype(int).clip(0, np.array(values.shape) - 2)
        nearer = place - first > 0.5
        signed, unsure = np.full(len(points), np.nan), np.arange(len(points))
        for corner in np.ndindex(2, 2, 2):
            # The nearest corner comes first, that opposite to it last.
            at = first[unsure] + (nearer[unsure] ^ np.array(corner, bool))
            value = values[tuple(at.T)].astype(float)
            apart = self.spacing * np.sqrt(np.square(place[unsure] - at).sum(axis=1))
            same = distance[unsure] + np.abs(value) > DISTANCE_FIELD.crossing * apart
            signed[unsure[same]] = np.copysign(distance[unsure[same]], value[same])
            unsure = unsure[~same]
        signed[unsure] = _signed(distance[unsure], sheet.turns(points[unsure]))
        return signed

    def crossed(self, a: Float[Tensor, "*b 3"], b: Float[Tensor, "*b 3"]) -> Bool[Tensor, "*b"]:
        """Whether the surface is between two points; False where only the grid is known."""
        if self.sheet is None:
            return torch.zeros(a.shape[:-1], dtype=torch.bool)
        return torch.from_numpy(self.sheet.between(a.double().numpy(), b.double().numpy()))

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
        spacing: metres between grid points; by default as fine as `DISTANCE_FIELD.points` allow.

    Raises:
        InputError: "mesh-empty" when no triangle has any area.
    """
    size = np.ptp(mesh.vertices, axis=0) + 2 * DISTANCE_FIELD.margin
    if spacing is None:
        spacing = float(
            np.cbrt(np.prod(size) / DISTANCE_FIELD.points).clip(
                DISTANCE_FIELD.finest, DISTANCE_FIELD.coarsest
            )
        )
    wide = np.ceil(size / (DISTANCE_FIELD.stride * spacing)).astype(int)
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    low = middle - wide * DISTANCE_FIELD.stride * spacing / 2
    sheet = _Sheet(_tidy(mesh))
    return DistanceField(
        low=torch.from_numpy(low).float(),
        spacing=spacing,
        values=_measured(sheet, low, spacing, wide),
        sheet=sheet,
    )


class _Sheet(Triangles):
    """Triangles that also tell the inside from the outside."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        super().__init__(np.asarray(mesh.vertices), np.asarray(mesh.faces))
        self._low, self._high = mesh.bounds
        self._winding = igl.FastWindingNumberBVH()
        self._winding.init(*self.mesh)

    def turns(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " points"]:
        """How often the surface winds around each point, either way; beyond its box, not at all."""
        within = ((points > self._low) & (points < self._high)).all(axis=1)
        turns = np.zeros(len(points))
        if within.any():
            turns[within] = np.abs(
                self._winding.winding_number(points[within], DISTANCE_FIELD.winding_accuracy)
            )
        return turns

    def signed(self, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " points"]:
        """Signed distances of points."""
        return _signed(self.distance(points), self.turns(points))


def _measured(
    sheet: _Sheet, low: Float[np.ndarray, "3"], spacing: float, wide: Int[np.ndarray, "3"]
) -> Float[Tensor, "x y z"]:
    """Signed distances of a grid: exact near the surface, interpolated in the empty rest."""
    places = low + DISTANCE_FIELD.stride * spacing * np.argwhere(np.ones(wide + 1))
    rough = torch.from_numpy(sheet.signed(places).reshape(wide + 1))[None, None]
    shape = tuple(DISTANCE_FIELD.stride * wide + 1)
    values = interpolate(rough, shape, mode="trilinear", align_corners=True)[0, 0].numpy()
    near = np.flatnonzero(np.abs(values) < DISTANCE_FIELD.band * DISTANCE_FIELD.stride * spacing)
    at = low + spacing * np.stack(np.unravel_index(near, shape), axis=-1)
    values.flat[near] = sheet.signed(at)
    return torch.from_numpy(values).float()


def _signed(
    distance: Float[np.ndarray, "*b"], turns: Float[np.ndarray, "*b"]
) -> Float[np.ndarray, "*b"]:
    return np.where(turns > 0.5, -distance, distance)


def _tidy(mesh: ObjectMesh) -> trimesh.Trimesh:
    """The mesh with equal vertices merged, repeated faces left out, and faces wound alike."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    solid.update_faces(solid.unique_faces() & solid.nondegenerate_faces())
    if len(solid.faces) == 0:
        # igl ends the whole process on a mesh without faces.
        raise InputError(
            "mesh-empty",
            "The object's mesh has no triangle with any area.",
            where=mesh.name,
            fix="Give the object's surface as triangles.",
        )
    return trimesh.Trimesh(solid.vertices, _wound_alike(solid), process=False)


def _wound_alike(mesh: trimesh.Trimesh) -> Int[np.ndarray, "faces 3"]:
    """Faces of each connected piece wound as most of its area is."""
    faces = np.asarray(mesh.faces)
    wound, piece = (np.asarray(found).astype(np.int64) for found in igl.bfs_orient(faces))
    agrees = (wound == faces).all(axis=1)
    vote = np.bincount(piece, weights=np.where(agrees, mesh.area_faces, -mesh.area_faces))
    return np.where((vote < 0)[piece, None], wound[:, ::-1], wound)
