"""Marker tracks and places on a scan become the motion of the scanned object at 30 fps.

A pose is the orthogonal Procrustes solution over the markers that are seen (OMOMO, section 4). Places
that are picked on a scan are off by a centimetre, and a pose would leap by as much whenever a marker is
lost. So the recording itself says how the markers stand to each other, and the picked places are only
asked, once for all frames, how the scan lies in that, and at which scale.
"""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation, Slerp

from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import procrustes, to_local
from omomo_core.learning.recordings.marker_tracks import Places, Tracks, check_seen
from omomo_core.motion import FPS
from omomo_core.whole_file import whole_file

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
        """The mask of frames that have a pose."""
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
    """Return the mask of frames in which the markers that are kept fix a pose."""
    patterns, which = np.unique(kept, axis=0, return_inverse=True)
    return np.array([fixes_pose(shape[pattern]) for pattern in patterns])[which.reshape(-1)]


def fixes_pose(shape: Float[np.ndarray, "n 3"]) -> bool:
    """Whether these markers (metres) fix a pose: three or more, not in a line."""
    if len(shape) < 3:
        return False
    return bool(np.linalg.svd(shape - shape.mean(axis=0), compute_uv=False)[1] > _ACROSS)


_PICKED = 0.05
"""Metres by which a place picked on a scan may be off."""
_MOSTLY = 0.5
_SHORTEST = 1.0
"""Seconds of motion that can become a take."""
_SAME_TIME = 1e-6


@dataclass(frozen=True)
class Solving:
    """How markers are made poses."""

    tolerance: float = 0.01
    """Metres that a marker may be off the others before it is left out of a frame."""
    bridge: float = 0.25
    """Seconds without a pose that may be filled."""


@dataclass(frozen=True)
class Span:
    """Some time of a recording, seconds."""

    start: float
    end: float
    what: str

    def __str__(self) -> str:
        return f"{self.start:.2f} to {self.end:.2f} s: {self.what}"


@dataclass(frozen=True)
class MarkedMotion:
    """The motion of a scan, and how well the markers fix it."""

    T_world_object: Float[np.ndarray, "frames 4 4"]
    """Poses of the mesh in the axes of its file, scaled by `scale`; 30 fps, metres."""
    scale: float
    """Metres per unit of the mesh's file."""
    start: float
    """Time of frame 0 in the recording, seconds."""
    picked_off: Float[np.ndarray, " markers"]
    """How far the place of each marker on the scan is from the marker, metres."""
    jitter: Float[np.ndarray, " markers"]
    """How far each marker is off the others, root of the mean square over its frames, metres."""
    gaps: tuple[Span, ...]
    """Times without a pose that were bridged, or left off at the ends."""
    outliers: tuple[Span, ...]
    """Times in which a marker was seen but left out."""


def solve(tracks: Tracks, places: Places, solving: Solving | None = None) -> MarkedMotion:
    """Poses of the scanned object over the whole recording.

    Args:
        tracks: of the object's markers and perhaps of others.
        places: of the object's markers on the scan.
        solving: what may be off, and how long.

    Raises:
        InputError: ``marker-missing``, ``marker-twice``, ``markers-unseen``, ``markers-units``,
            ``markers-in-line``, ``markers-do-not-fit``, ``marker-place``, ``markers-gap``.
    """
    options = solving or Solving()
    tracks = tracks.of(places)
    check_seen(tracks)
    shape = rough_shape(tracks.points, places.points)
    if not fixes_pose(shape):
        raise InputError(
            "markers-in-line",
            "The places of the markers are in a line: the turn about it is open.",
            where=str(places.source),
            fix="Add a marker beside that line.",
        )
    rough, posed, shape = refined(tracks.points, shape, _PICKED, options.tolerance)
    _check_fit(rough, tracks, places)
    gaps = _gaps(posed.valid, tracks, options.bridge)
    ever = posed.kept.any(axis=0)
    fit = procrustes(shape, places.points, ever.astype(float), scaled=True)
    T_shape_object = np.eye(4)
    T_shape_object[:3, :3], T_shape_object[:3, 3] = fit.R, fit.t
    T = posed.T_world_shape[posed.valid] @ T_shape_object
    times = tracks.times[posed.valid]
    off = np.where(posed.kept, posed.off, np.nan)
    jitter = np.full(len(places.names), np.nan)
    jitter[ever] = np.sqrt(np.nanmean(off[:, ever] ** 2, axis=0))
    return MarkedMotion(
        T_world_object=_at_30_fps(times, T),
        scale=fit.scale,
        start=float(times[0]),
        picked_off=np.where(ever, np.linalg.norm(fit.residuals, axis=1), np.nan),
        jitter=jitter,
        gaps=gaps,
        outliers=_outliers(posed, tracks),
    )


def write_motion(path: Path, motion: MarkedMotion, up: str) -> None:
    """Write poses for `omocap run`: obj_pos, obj_rot_xyzw, fps, up, and the scale of the mesh.

    Args:
        path: the npz; it appears whole or not at all.
        motion: from `solve`.
        up: which axis of the recording's world points up, "y" or "z".
    """
    xyzw = Rotation.from_matrix(motion.T_world_object[:, :3, :3]).as_quat()
    with whole_file(path) as partial, partial.open("wb") as file:
        np.savez_compressed(
            file,
            obj_pos=motion.T_world_object[:, :3, 3],
            obj_rot_xyzw=xyzw,
            fps=np.array(FPS),
            up=np.array(up),
            mesh_scale=np.array(motion.scale),
        )


def _check_fit(rough: Posed, tracks: Tracks, places: Places) -> None:
    """Refuse places of which one, or all, are not where the markers are."""
    seen = np.isfinite(tracks.points).all(axis=2)
    could = seen.sum(axis=1) >= 3
    if rough.valid.sum() < _MOSTLY * could.sum():
        raise InputError(
            "markers-do-not-fit",
            f"In {could.sum() - rough.valid.sum()} of {could.sum()} frames the markers are not as "
            f"far apart as their places ({100 * _PICKED:.0f} cm off or more).",
            where=str(places.source),
            fix="Check that tracks and places are of the same markers, both right-handed, and that "
            "no two names are exchanged.",
        )
    here = seen & rough.valid[:, None]
    out = (here & ~rough.kept).sum(axis=0)
    for marker in np.flatnonzero(out > _MOSTLY * here.sum(axis=0).clip(1)):
        off = float(np.nanmedian(rough.off[:, marker]))
        raise InputError(
            "marker-place",
            f"Marker {places.names[marker]!r} is {100 * off:.0f} cm from its place on the scan in "
            "most frames.",
            where=str(places.source),
            fix="Pick its place again, or take it out of the file.",
        )


def _gaps(valid: Bool[np.ndarray, " frames"], tracks: Tracks, bridge: float) -> tuple[Span, ...]:
    """Times without a pose; those at the ends are left off, longer ones inside are refused."""
    times, good = tracks.times.tolist(), np.flatnonzero(valid)
    inside = times[good[-1]] - times[good[0]] if len(good) else 0.0
    if inside < _SHORTEST:
        raise InputError(
            "markers-gap",
            f"The markers fix the object's pose for {inside:.2f} s only.",
            where=str(tracks.source),
            fix="Label them in more frames.",
        )
    spans = [Span(times[a], times[b - 1], _unseen(tracks, a, b)) for a, b in runs(~valid)]
    longest = max(bridge, 1.5 * float(np.median(np.diff(tracks.times))))
    long = [
        Span(times[a], times[b], _unseen(tracks, a + 1, b))
        for a, b in pairwise(good.tolist())
        if times[b] - times[a] > longest + _SAME_TIME
    ]
    if long:
        more = f" and {len(long) - 4} more" if len(long) > 4 else ""
        raise InputError(
            "markers-gap",
            f"For longer than {bridge:g} s the markers do not fix the object's pose.",
            where=f"{tracks.source}, {'; '.join(map(str, long[:4]))}{more}",
            fix="Label or fill those markers, take a part with ‹start› and ‹end›, or have a longer "
            "gap filled with ‹bridge› SECONDS.",
        )
    return tuple(spans)


def _unseen(tracks: Tracks, first: int, last: int) -> str:
    """What is wrong with the markers in some frames that have no pose."""
    if first >= last:
        return "no frames"
    seen = np.isfinite(tracks.points[first:last]).all(axis=2).mean(axis=0) > _MOSTLY
    missing = [name for name, there in zip(tracks.names, seen, strict=True) if not there]
    if seen.sum() >= 3:
        return "markers contradict each other or are in a line"
    return f"{', '.join(missing)} not seen"


def _outliers(posed: Posed, tracks: Tracks) -> tuple[Span, ...]:
    """When each marker was left out although it was seen."""
    seen = np.isfinite(tracks.points).all(axis=2) & posed.valid[:, None]
    spans: list[Span] = []
    for marker, name in enumerate(tracks.names):
        for first, last in runs(seen[:, marker] & ~posed.kept[:, marker]):
            off = 100 * float(posed.off[first:last, marker].max())
            start, end = float(tracks.times[first]), float(tracks.times[last - 1])
            spans.append(Span(start, end, f"{name} up to {off:.0f} cm off"))
    return tuple(sorted(spans, key=lambda span: span.start))


def _at_30_fps(
    times: Float[np.ndarray, " frames"], T: Float[np.ndarray, "frames 4 4"]
) -> Float[np.ndarray, "out 4 4"]:
    """Poses every 1/30 s by their times: positions linearly, rotations along the shortest arc."""
    wanted = np.arange(times[0], times[-1] + _SAME_TIME, 1.0 / FPS).clip(times[0], times[-1])
    out = np.tile(np.eye(4), (len(wanted), 1, 1))
    out[:, :3, :3] = Slerp(times, Rotation.from_matrix(T[:, :3, :3]))(wanted).as_matrix()
    for axis in range(3):
        out[:, axis, 3] = np.interp(wanted, times, T[:, axis, 3])
    return out
