"""Markers on one rigid thing: how they stand to each other, and its pose in every frame.

A pose is the orthogonal Procrustes solution over the markers that are seen (OMOMO, section 4). Places
that are picked on a scan are off by a centimetre, and a pose would leap by as much whenever a marker is
lost. So the recording itself says how the markers stand to each other, and the picked places are only
asked, once for all frames, how the scan lies in that, and at which scale.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float

from omomo_core.geometry.transforms import to_local

_ACROSS = 0.015
"""Metres that markers must spread across their line: else the turn about it is a guess."""
_ROUNDS = 3

Points = Float[np.ndarray, "frames markers 3"]
"""World, metres; NaN where a marker is not seen."""
Kept = Bool[np.ndarray, "frames markers"]
Shape = Float[np.ndarray, "markers 3"]
"""Markers of the rigid thing in a frame of its own, metres."""


@dataclass(frozen=True)
class Posed:
    """The thing's pose in every frame."""

    T_world_shape: Float[np.ndarray, "frames 4 4"]
    """NaN where the markers do not fix it."""
    kept: Kept
    """The markers it was found by."""
    off: Float[np.ndarray, "frames markers"]
    """How far each marker is from where the pose puts it, metres; NaN where one of them is unknown."""

    @property
    def valid(self) -> Bool[np.ndarray, " frames"]:
        """Where there is a pose."""
        return np.isfinite(self.T_world_shape[:, 0, 0])

    @property
    def worst(self) -> Float[np.ndarray, " frames"]:
        """How far the farthest marker that was kept is off, metres; NaN where there is no pose."""
        return np.where(self.valid, np.where(self.kept, self.off, 0.0).max(axis=1), np.nan)

    def local(self, points: Points) -> Points:
        """Markers in the frame of the shape."""
        return to_local(self.T_world_shape, points)


def rough_shape(points: Points, places: Shape) -> Shape:
    """Places in any unit brought to metres: as far apart as the markers are in most frames."""
    a, b = np.triu_indices(len(places), 1)
    apart = np.linalg.norm(points[:, a] - points[:, b], axis=-1)
    known = np.isfinite(apart).any(axis=0)
    measured = np.nanmedian(apart[:, known], axis=0)
    picked = np.linalg.norm(places[a] - places[b], axis=-1)[known]
    return places * float(np.median(measured / picked.clip(1e-12)))


def refined(
    points: Points, shape: Shape, first: float, tolerance: float
) -> tuple[Posed, Posed, Shape]:
    """Poses by the given shape, then by the shape that the recording shows.

    Args:
        points: world, NaN where a marker is not seen.
        shape: roughly how they stand to each other.
        first: how far a marker may be off by that shape, metres.
        tolerance: by the shape of the recording.

    Returns:
        Poses by the given shape; by the recorded one; and that one.
    """
    posed = rough = poses(points, shape, first)
    for _ in range(_ROUNDS):
        local = np.where(posed.kept[..., None], posed.local(points), np.nan)
        known = posed.kept.any(axis=0)
        shape = shape.copy()
        shape[known] = np.nanmedian(local[:, known], axis=0)
        posed = poses(points, shape, tolerance)
    return rough, posed, shape


def poses(points: Points, shape: Shape, tolerance: float) -> Posed:
    """The pose of a shape in each frame, without the markers that contradict the others.

    Args:
        points: world, metres; NaN where a marker is not seen.
        shape: how the markers stand to each other.
        tolerance: metres that a marker may be off its place.
    """
    kept = np.asarray(np.isfinite(points).all(axis=2))
    posed = _fitted(points, shape, kept)
    # Of three markers that do not fit nobody can tell which is wrong.
    for _ in range(len(shape) - 3):
        bad = np.flatnonzero(posed.worst > tolerance)
        if len(bad) == 0:
            break
        kept = kept.copy()
        kept[bad] = _without_one(points[bad], shape, kept[bad])
        posed = _fitted(points, shape, kept)
    wrong = ~(posed.worst <= tolerance)
    T, kept, off = posed.T_world_shape.copy(), kept.copy(), posed.off.copy()
    T[wrong], kept[wrong], off[wrong] = np.nan, False, np.nan
    return Posed(T, kept, off)


def _without_one(points: Points, shape: Shape, kept: Kept) -> Kept:
    """In each frame without the marker that the others fit best without."""
    misfits = np.full(kept.shape, np.inf)
    for marker in range(len(shape)):
        fewer = kept & (np.arange(len(shape)) != marker)
        off = np.where(fewer, _fitted(points, shape, fewer).off, 0.0)
        # Who is not there cannot be left out; and NaN, where the rest fixes no pose, is worst.
        misfits[:, marker] = np.where(kept[:, marker], (off**2).sum(axis=1), np.inf)
    best = np.nan_to_num(misfits, nan=np.inf).argmin(axis=1)
    return kept & (np.arange(len(shape)) != best[:, None])


def _fitted(points: Points, shape: Shape, kept: Kept) -> Posed:
    """Least squares in each frame over the markers that are kept."""
    fixed = _fixed_frames(shape, kept)
    T = np.full((len(points), 4, 4), np.nan)
    if fixed.any():
        here = torch.from_numpy(np.where(kept[..., None], points, 0.0)[fixed])
        weights = torch.from_numpy(kept[fixed].astype(float))
        same = torch.from_numpy(shape).expand_as(here)
        fit = roma.rigid_points_registration(same, here, weights)
        R, t = cast(tuple[torch.Tensor, torch.Tensor], fit)
        T[fixed] = np.eye(4)
        T[fixed, :3, :3], T[fixed, :3, 3] = R.numpy(), t.numpy()
    posed = Posed(T, kept, np.full(kept.shape, np.nan))
    return Posed(T, kept, np.linalg.norm(posed.local(points) - shape, axis=-1))


def _fixed_frames(shape: Shape, kept: Kept) -> Bool[np.ndarray, " frames"]:
    """Where the markers that are kept fix a pose."""
    patterns, which = np.unique(kept, axis=0, return_inverse=True)
    return np.array([fixes_pose(shape[pattern]) for pattern in patterns])[which.reshape(-1)]


def fixes_pose(shape: Float[np.ndarray, "n 3"]) -> bool:
    """Whether these markers (metres) fix a pose: three or more, not in a line."""
    if len(shape) < 3:
        return False
    return bool(np.linalg.svd(shape - shape.mean(axis=0), compute_uv=False)[1] > _ACROSS)
