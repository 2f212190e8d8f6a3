"""The visual hull, the evidence against it, and thin parts.

A place that some pictures show beside the silhouette is empty, with the distance to the outline as a
signed distance (Laurentini 1994; the second or third largest over the pictures, as single masks err).
A place that pictures show inside the silhouette where no depth is known is backed by them: thin and
dark parts have no depth. Right beside depth that is known, a lack of it says nothing. Beside a bar a
quarter of the pictures decides: masks miss it where what lies behind it has its colour.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8
from scipy.ndimage import binary_dilation, distance_transform_edt, uniform_filter

from ingest.scan.dense.depth_maps import Depths
from ingest.scan.dense.stereo import DepthMap, matrix_for, pixel_rays
from ingest.scan.dense.volume import Box, Volume, grounded, open_places
from ingest.scan.scan_types import Progress, Region
from omomo_core.geometry.transforms import inverse

BAR = 0.025
"""Metres: thinner parts have no depth that can be trusted, and silhouettes bound them."""


def thin_parts(
    inside: Bool[np.ndarray, "z y x"], voxel: float, radius: float
) -> Bool[np.ndarray, "z y x"]:
    """Places of a solid into which no ball of the radius fits that stays inside of it.

    Args:
        inside: the solid.
        voxel, radius: metres.
    """
    step = 2 if voxel < radius / 4 else 1
    coarse = np.pad(inside[::step, ::step, ::step], 1)
    # The floor below does not end a solid that stands on it.
    coarse[0] = coarse[1]
    core = np.asarray(distance_transform_edt(coarse)) * (step * voxel) >= radius
    thick = np.asarray(distance_transform_edt(~core)) * (step * voxel) <= radius
    found = coarse & ~thick
    for axis in range(3):
        found = np.repeat(found.take(range(1, found.shape[axis] - 1), axis), step, axis)
    z, y, x = inside.shape
    return found[:z, :y, :x] & inside


_INWARD = 0.4
"""Pixels by which outlines are moved outwards, because of many pictures the one that cuts most counts."""
_FAR = 12.0
"""Pixels from the outline beyond which distances are not told apart."""
_OUTVOTED = 20, 8
"""With so many pictures, the two or the one that put a place farthest outside are ignored as errors."""
_BACKED, _BACKED_SHARE = 4, 0.25
"""Pictures that must back a place, and their share among those that back it or see something before it."""
_EDGE = 5
"""Pixels from known depth within which missing depth says nothing (two pixels of a phone's depth map)."""
_BEFORE = 0.02
"""Metres by which depth must lie before a place to hide it."""
_DENIED = 0.25
"""Share of the pictures that must show the background at a place beside a bar before it counts as empty.
Asking for a half would leave a round bar 1.4 times as thick as it is: from half of the sides, such a place
lies before the bar or behind it."""
_VOTE = 2.0
"""Voxels by which a place counts as outside of the silhouettes where twice that share of the pictures
show the background."""
_UNKNOWN = np.float32(-1.0)
"""Metres outside, of places that a picture does not show: they count as inside."""


class VisualHull:
    """What silhouettes say of each place of a box, summed slice by slice."""

    def __init__(self, box: Box, pictures: int) -> None:
        """Begin without silhouettes.

        Args:
            box: where it is.
            pictures: that will be added.
        """
        self.box = box
        self._ignored = sum(pictures >= least for least in _OUTVOTED)
        levels = self._ignored + 1
        self._outside = np.full((levels, *box.shape), _UNKNOWN, np.float32)
        self._backing = np.zeros(box.shape, np.uint8)
        self._against = np.zeros(box.shape, np.uint8)
        self._hidden = np.zeros(box.shape, np.uint8)
        self._decided: Float32[np.ndarray, "z y x"] | None = None

    def add(
        self,
        mask: UInt8[np.ndarray, "h w"],
        depth: DepthMap,
        matrix: Float64[np.ndarray, "3 3"],
        T_camera_floor: Float64[np.ndarray, "4 4"],
        doubt: float = 0.0,
    ) -> None:
        """Add one more silhouette.

        Args:
            mask: 0 where the picture shows the background, 1 the object, more where it tells nothing.
            depth: of the same size; 0 where the object's is unknown.
            matrix, T_camera_floor: of the picture.
            doubt: metres by which what it says to be empty begins farther out.
        """
        outline = outline_distance(mask)
        shows = (mask == 1).astype(np.uint8)
        bare = _without_depth(shows, depth)
        P = matrix @ T_camera_floor[:3]
        step = (P[:, :3] * self.box.voxel).astype(np.float32)
        start = (P[:, :3] @ self.box.low + P[:, 3]).astype(np.float32)
        _, rows, columns = self.box.shape
        x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
        level = [step[k, 0] * x + step[k, 1] * y + start[k] for k in range(3)]
        for index in range(self.box.shape[0]):
            u, v, z = (level[k] + step[k, 2] * np.float32(index) for k in range(3))
            ahead = np.maximum(z, np.float32(1e-3))
            u, v = u / ahead, v / ahead
            beside = cv2.remap(outline, u, v, cv2.INTER_LINEAR, borderValue=-1e6)
            known = (z > 0) & (beside > -1e3)
            metres = np.where(
                known, beside * z / np.float32(matrix[0, 0]) - np.float32(doubt), _UNKNOWN
            )
            self._rank(index, metres)
            self._against[index] += known & (metres > 0)
            shown = cv2.remap(depth, u, v, cv2.INTER_NEAREST, borderValue=0)
            inside = known & (cv2.remap(shows, u, v, cv2.INTER_NEAREST, borderValue=0) > 0)
            self._backing[index] += inside & (
                cv2.remap(bare, u, v, cv2.INTER_NEAREST, borderValue=0) > 0
            )
            self._hidden[index] += inside & (shown > 0) & (shown < z - _BEFORE)

    def _rank(self, index: int, metres: Float32[np.ndarray, "y x"]) -> None:
        """Keep the largest distances of each place, in falling order."""
        for largest in self._outside[:, index]:
            smaller = np.minimum(largest, metres)
            np.maximum(largest, metres, out=largest)
            metres = smaller

    def outside(self) -> Float32[np.ndarray, "z y x"]:
        """Metres by which a place lies outside of the silhouettes, below 0 inside."""
        if self._decided is None:
            voxel = self.box.voxel
            backing, against = self.backing(), self._against.astype(np.float32)
            share = against / np.maximum(against + backing, np.float32(1))
            vote = np.float32(_VOTE * voxel) * (share / np.float32(_DENIED) - 1).clip(-1, 1)
            vote = np.where(backing >= _BACKED, vote, np.inf)
            strict = self._outside[self._ignored]
            thin = thin_parts(np.minimum(strict, vote) < 0, voxel, BAR)
            # Beside a thick thing most pictures show it before or behind a place.
            thick = (strict < 0) & ~thin_parts(strict < 0, voxel, BAR)
            bars = _around(thin) & ~_around(thick)
            self._decided = np.where(bars, np.minimum(strict, vote), strict)
        return self._decided

    def backing(self) -> Float32[np.ndarray, "z y x"]:
        """Pictures that show the object at a place without knowing its depth."""
        return self._backing.astype(np.float32)

    def hidden(self) -> Float32[np.ndarray, "z y x"]:
        """Pictures that see something before a place."""
        return self._hidden.astype(np.float32)

    def backed(self, against: Float32[np.ndarray, "z y x"]) -> Bool[np.ndarray, "z y x"]:
        """Places where pictures show the object without knowing its depth.

        Args:
            against: as many of them must back a place, e.g. for those that see through it.
        """
        backing, hidden = self.backing(), self.hidden()
        enough = (backing >= _BACKED) & (backing >= _BACKED_SHARE * (backing + hidden))
        return enough & (backing >= against) & (self.outside() < 0)


def _around(places: Bool[np.ndarray, "z y x"]) -> Bool[np.ndarray, "z y x"]:
    return np.asarray(binary_dilation(places, iterations=2), np.bool_)


def _without_depth(shows: UInt8[np.ndarray, "h w"], depth: DepthMap) -> UInt8[np.ndarray, "h w"]:
    """1 where a silhouette holds something that has no depth, and is not the rim of what has some.

    Depth is dropped at edges, and outlines lie some pixels too far outside: neither shows a thin part.
    """
    measured = ((shows > 0) & (depth > 0)).astype(np.uint8)
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _EDGE + 1, 2 * _EDGE + 1))
    return np.where(cv2.dilate(measured, around) > 0, np.uint8(0), shows)


def outline_distance(mask: UInt8[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Pixels from the outline of a mask, positive outside of it."""
    shown = (mask > 0).astype(np.uint8)
    away = cv2.distanceTransform(1 - shown, cv2.DIST_L2, 5)
    into = cv2.distanceTransform(shown, cv2.DIST_L2, 5)
    # Pixel centres on both sides of the outline lie half a pixel from it.
    distance = np.where(mask > 0, 0.5 - into, away - 0.5) - _INWARD
    return distance.clip(-_FAR, _FAR).astype(np.float32)


SURE = 2.0
"""Views that must have seen a surface before it counts as seen."""
_LOW = 0.015
"""Metres above the floor below which depth in a silhouette is the floor's."""
_THROUGH = 0.5
"""Pictures that must back a place, as a share of the pictures that see through it."""
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


def gather_evidence(
    depths: Depths,
    masks: Sequence[Mask | None],
    region: Region,
    box: Box,
    band: float,
    progress: Progress,
    mirror: Float64[np.ndarray, "4 4"] | None = None,
) -> Evidence:
    """The evidence of depth maps and silhouettes together.

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
            maps = [_object_depth(depth, mask, matrix, T, region) for depth in maps]
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
    backed = _without_noise(hull.backed(_THROUGH * volume.free()) | _thin_places(volume, hull))
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


def _without_noise(places: Bool[np.ndarray, "z y x"]) -> Bool[np.ndarray, "z y x"]:
    """Places with most of those around them: single ones are noise."""
    around = np.asarray(uniform_filter(places.astype(np.float32), 3, mode="nearest"))
    return places & (around > 0.5)


def _thin_places(volume: Volume, hull: VisualHull) -> Bool[np.ndarray, "z y x"]:
    """Parts of the hull too thin for depth, which enough pictures show with nothing before them."""
    seen, free = volume.seen(), volume.free()
    shown = seen + hull.backing()
    asked = shown + hull.hidden()
    return (
        thin_parts(hull.outside() < 0, volume.box.voxel, BAR)
        & (free < _HALF * (free + asked))
        & (shown >= _SHOWN * asked)
    )


def _object_depth(
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
