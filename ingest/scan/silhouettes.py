"""The object's silhouette in each picture, told from the floor's look and from depth.

Labels come from what is sure (the box, depth, the look of the bare floor); GrabCut (Rother, Kolmogorov and
Blake 2004) settles the rest by colours and edges.

Every place of the floor is hidden by the object in some pictures only, and its shadow lies on the floor
in all of them; the median over the pictures is the floor without the object (background subtraction,
with the parallax of the film in the place of a still camera).
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8

from ingest.scan.dense.depth_maps import Depths
from ingest.scan.dense.stereo import (
    DepthMap,
    SmallPictures,
    at_pixels,
    matrix_for,
    pixel_rays,
    projected,
)
from ingest.scan.scan_types import Progress, Region, no_progress
from omomo_core.geometry.transforms import inverse

_CELLS = 520
"""Along each side of the map of the floor."""
_MAP_REACH = 1.3
"""Sizes of the object by which the map goes beyond its box on every side."""
_VIEWS = 36
"""Pictures that the map is made of, at most."""
_IN_FRONT = 0.06
"""Metres before the floor at which depth says that something hides it."""
_FEWEST_PICTURES = 3
"""Pictures that must show a place of the floor."""
_NOISE = np.array([8.0, 3.0, 3.0], np.float32)
"""Least noise of lightness and of the two colours from picture to picture (8-bit L*a*b*)."""
_WILD = np.array([24.0, 12.0, 12.0], np.float32)
"""Spread of lightness and colours over the pictures from which on a place is no floor."""
_SOFT = 1.0
"""Standard deviation of the blur of pictures before they are compared, pixels."""
_AROUND, _ODD = 25, 3.0
"""Width of the neighbourhood of a place of the floor, cells, and standard deviations from its colour."""
_FLAT = -0.05
"""Vertical component of a ray of depth 1: flatter rays see too much floor in a pixel."""

Lab = Float32[np.ndarray, "h w 3"]


@dataclass(frozen=True)
class FloorBackground:
    """A map of the floor: colours as most pictures show them."""

    low: Float64[np.ndarray, "2"]
    """Middle of the first cell, in the floor's frame, metres."""
    cell: float
    colour: Float32[np.ndarray, "y x 3"]
    """8-bit L*a*b*."""
    spread: Float32[np.ndarray, "y x 3"]
    """Robust standard deviation over the pictures."""
    known: Bool[np.ndarray, "y x"]
    shift: Float32[np.ndarray, "views 3"]
    """How much brighter and more coloured each picture is than the map."""

    def imprint(self) -> Bool[np.ndarray, "y x"]:
        """Places unlike the floor around them: what never leaves them, such as feet, looks like floor."""
        usual = cv2.medianBlur(np.rint(self.colour).clip(0, 255).astype(np.uint8), _AROUND)
        apart = (self.colour - usual) / np.sqrt(self.spread**2 + _NOISE**2)
        return self.known & ((apart**2).sum(axis=-1) > _ODD**2)

    def contrast(
        self, index: int, pictures: SmallPictures, T_world_floor: Float64[np.ndarray, "4 4"]
    ) -> tuple[Float32[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]:
        """How unlike the bare floor each pixel of a picture is, and whether that is an imprint there.

        Returns:
            Standard deviations, NaN off the map; and what `imprint` says.
        """
        width, height = pictures.size(index)
        rays = pixel_rays((height, width), pictures.matrix(index))
        T = inverse(T_world_floor) @ pictures.views[index].T_world_camera
        x, y, down = np.moveaxis(rays @ T[:3, :3].T.astype(np.float32), -1, 0)
        far = np.float32(-T[2, 3]) / np.minimum(down, np.float32(_FLAT))
        u = (np.float32(T[0, 3]) + far * x - np.float32(self.low[0])) / np.float32(self.cell)
        v = (np.float32(T[1, 3]) + far * y - np.float32(self.low[1])) / np.float32(self.cell)
        bare = _sampled(self.colour, u, v) + self.shift[index]
        noise = np.sqrt(_sampled(self.spread, u, v) ** 2 + _NOISE**2)
        apart = _least_apart(lab_of(pictures, index), bare, noise)
        there = cv2.remap(self.known.astype(np.uint8), u, v, cv2.INTER_NEAREST, borderValue=0)
        odd = cv2.remap(self.imprint().astype(np.uint8), u, v, cv2.INTER_NEAREST, borderValue=0)
        return np.where((there > 0) & (down < _FLAT), apart, np.float32(np.nan)), odd > 0


def _sampled(
    values: Float32[np.ndarray, "y x 3"],
    u: Float32[np.ndarray, "h w"],
    v: Float32[np.ndarray, "h w"],
) -> Lab:
    return np.asarray(cv2.remap(values, u, v, cv2.INTER_LINEAR), np.float32)


def _least_apart(shown: Lab, bare: Lab, noise: Lab) -> Float32[np.ndarray, "h w"]:
    """Distance of colours, at the best of nine shifts of a pixel: cameras are not placed better."""
    least = np.full(shown.shape[:2], np.inf, np.float32)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            moved = np.roll(bare, (down, right), (0, 1))
            np.minimum(least, (((shown - moved) / noise) ** 2).sum(axis=-1), out=least)
    return np.sqrt(least)


def lab_of(pictures: SmallPictures, index: int) -> Lab:
    """A picture of a view in 8-bit L*a*b*, slightly blurred."""
    lab = cv2.cvtColor(pictures.picture(index).colours, cv2.COLOR_RGB2LAB)
    return cv2.GaussianBlur(lab, (0, 0), _SOFT).astype(np.float32)


def floor_background(pictures: SmallPictures, depths: Depths, region: Region) -> FloorBackground:
    """The map of the floor around an object.

    Args:
        pictures: of the views.
        depths: of the same views; where they show something before the floor, it is not taken for it.
        region: the floor, and the box of the object.
    """
    size = region.high - region.low
    half = size[:2].max() / 2 + _MAP_REACH * float(size.max())
    cell = float(2 * half / _CELLS)
    low = (region.low + region.high)[:2] / 2 - half + cell / 2
    used = np.unique(np.linspace(0, len(pictures.views) - 1, _VIEWS).astype(int))
    x, y = np.meshgrid(*(low[k] + cell * np.arange(_CELLS) for k in range(2)))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    T = region.T_world_floor
    points = points @ T[:3, :3].T + T[:3, 3]
    shown = np.stack([_shown(points, pictures, depths, int(k)) for k in used])
    colour, known = _median(shown)
    shift = np.zeros((len(pictures.views), 3), np.float32)
    for index in range(len(pictures.views)):
        mine = _shown(points, pictures, depths, index)
        both = (mine[..., 0] < _HIDDEN) & known
        if both.sum() > _CELLS:
            shift[index] = np.median(mine[both] - colour[both], axis=0)
    level = np.where(
        shown < _HIDDEN, shown - np.rint(shift[used])[:, None].astype(np.int16), _HIDDEN
    )
    colour, known = _median(level.astype(np.int16))
    apart = np.where(level < _HIDDEN, np.abs(level - colour), _HIDDEN)
    spread = 1.4826 * _median(apart.astype(np.int16))[0]
    # Where pictures differ there is no floor: a wall stands before it, or it shines.
    known &= (spread < _WILD).all(axis=-1)
    sides = (_CELLS, _CELLS)
    return FloorBackground(
        low, cell, colour.reshape(*sides, 3), spread.reshape(*sides, 3), known.reshape(sides), shift
    )


_HIDDEN = 10_000
"""Marks a place that a picture does not show; larger than every colour, so that it sorts last."""


def _shown(
    points: Float64[np.ndarray, "points 3"], pictures: SmallPictures, depths: Depths, index: int
) -> np.ndarray:
    """Colours (int16) that a picture has where places of the floor would be, `_HIDDEN` if it cannot."""
    view, (width, height) = pictures.views[index], pictures.size(index)
    u, v, z = projected(points, view.T_world_camera, pictures.matrix(index))
    sees = (u > 1) & (v > 1) & (u < width - 2) & (v < height - 2) & (z > 0)
    for maps in depths.kinds:
        sees &= ~_before(
            maps[index], points, view.T_world_camera, matrix_for(view, maps[index].shape[::-1])
        )
    lab = lab_of(pictures, index).astype(np.uint8)
    colours = at_pixels(lab, u, v, cv2.INTER_LINEAR).astype(np.int16)
    return np.where(sees[:, None], colours, np.int16(_HIDDEN))


def _before(
    depth: DepthMap,
    points: Float64[np.ndarray, "points 3"],
    T_world_camera: Float64[np.ndarray, "4 4"],
    matrix: Float64[np.ndarray, "3 3"],
) -> Bool[np.ndarray, " points"]:
    """Whether depth shows something clearly nearer than the points."""
    u, v, z = projected(points, T_world_camera, matrix)
    shown = at_pixels(depth, u, v, cv2.INTER_NEAREST)
    return (shown > 0) & (shown < z - _IN_FRONT)


def _median(
    values: np.ndarray,
) -> tuple[Float32[np.ndarray, "points 3"], Bool[np.ndarray, " points"]]:
    """Lower median over the pictures that show a place, and whether enough do."""
    count = (values[..., 0] < _HIDDEN).sum(axis=0)
    middle = ((count - 1).clip(0) // 2)[None, :, None]
    median = np.take_along_axis(np.sort(values, axis=0), middle, axis=0)[0]
    known = count >= _FEWEST_PICTURES
    return np.where(known[:, None], median, 0).astype(np.float32), known


_LIKE, _UNLIKE = 2.0, 3.5
"""Standard deviations up to which a pixel is like the bare floor, and from which it is not."""
_SURE = 5.0
"""Standard deviations from which a pixel is the object for sure. GrabCut alone loses thin poles before things
of their colour."""
_OVER_FLOOR = 0.04
"""Metres over the floor where depth is the object's and not the floor's."""
_EDGE = 2
"""Pixels of a depth map by which it may be off at an edge."""
_BEYOND = 0.15
"""Metres outside the box where depth is certainly not the object's."""
_MISSED = 0.15
"""Part of what depth says to be the object that a mask may miss before it is not believed."""
_ROUNDS = 3
_MARGIN = 12
"""Pixels around the box in which colours of the background are learned."""
_FEWEST_PIXELS = 40
"""Pixels that must be the object's for sure, and of the background."""

_FEET_REACH = 21
"""Pixels around what is likely the object, in which its feet are looked for."""
_OBJECT = (cv2.GC_FGD, cv2.GC_PR_FGD)

BACKGROUND, OBJECT, UNKNOWN = 0, 1, 2
"""Values of masks. It is only before the floor that what is not the object is surely background: a thin
pole before a wall may be missed."""
Mask = UInt8[np.ndarray, "h w"]
Labels = UInt8[np.ndarray, "h w"]


def find_silhouettes(
    pictures: SmallPictures, depths: Depths, region: Region, *, progress: Progress = no_progress
) -> list[Mask | None]:
    """Masks of the object in all views, of `OBJECT` and others; None where one cannot be told.

    Args:
        pictures: of the views, `Detail.outlined` pixels wide.
        depths: of the same views.
        region: floor and box of the object.
        progress: called with the stage "silhouettes".
    """
    background = floor_background(pictures, depths, region)
    found: list[Mask | None] = []

    def find(index: int) -> Mask | None:
        return silhouette(pictures, depths, region, background, index)

    with ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as pool:
        for mask in pool.map(find, range(len(pictures.views))):
            found.append(mask)
            progress("silhouettes", len(found) / len(pictures.views))
    return found


def silhouette(
    pictures: SmallPictures, depths: Depths, region: Region, background: FloorBackground, index: int
) -> Mask | None:
    """The mask of the object in one view; None where nothing in it is sure."""
    box = _box(pictures, region, index)
    if not box.any():
        return None
    labels, told = _labels(pictures, depths, region, background, index, box)
    rows, columns = (np.flatnonzero(box.any(axis=k)) for k in (1, 0))
    top, bottom = max(0, rows[0] - _MARGIN), rows[-1] + _MARGIN + 1
    left, right = max(0, columns[0] - _MARGIN), columns[-1] + _MARGIN + 1
    part = labels[top:bottom, left:right].copy()
    object_like = np.isin(part, _OBJECT)
    if object_like.sum() < _FEWEST_PIXELS or (~object_like).sum() < _FEWEST_PIXELS:
        return None
    picture = pictures.picture(index).colours[top:bottom, left:right]
    back, front = np.zeros((1, 65)), np.zeros((1, 65))
    nowhere = (0, 0, 1, 1)  # A rectangle is not used where labels are given.
    cv2.setRNGSeed(index)
    picture = np.ascontiguousarray(picture)
    cv2.grabCut(picture, part, nowhere, back, front, _ROUNDS, cv2.GC_INIT_WITH_MASK)
    mask = np.zeros_like(labels)
    mask[top:bottom, left:right] = np.isin(part, _OBJECT)
    within, _ = _by_depth(depths, region, index, box.shape)
    mask[~told & (mask == BACKGROUND)] = UNKNOWN
    return mask if _covers(mask, within) else None


def _covers(mask: Mask, within: Bool[np.ndarray, "h w"]) -> bool:
    """Whether a mask holds most of what depth, away from its edges, says to be the object."""
    around = np.ones((4 * _EDGE + 1,) * 2, np.uint8)
    inner = cv2.erode(within.astype(np.uint8), around) > 0
    return bool((mask[inner] == 0).sum() <= _MISSED * max(1, inner.sum()))


def _labels(
    pictures: SmallPictures,
    depths: Depths,
    region: Region,
    background: FloorBackground,
    index: int,
    box: Bool[np.ndarray, "h w"],
) -> tuple[Labels, Bool[np.ndarray, "h w"]]:
    """What is sure about each pixel, and what is only likely; and where the floor tells."""
    shape = box.shape
    contrast, imprint = background.contrast(index, pictures, region.T_world_floor)
    within, outside = _by_depth(depths, region, index, shape)
    like, unlike = contrast < _LIKE, contrast > _UNLIKE
    labels = np.full(shape, cv2.GC_PR_BGD, np.uint8)
    labels[unlike & ~outside] = cv2.GC_PR_FGD
    labels[within & ~like] = cv2.GC_PR_FGD
    inner = cv2.erode(within.astype(np.uint8), np.ones((2 * _EDGE + 1,) * 2, np.uint8)) > 0
    labels[inner & (unlike | np.isnan(contrast))] = cv2.GC_FGD
    labels[(contrast > _SURE) & ~outside] = cv2.GC_FGD
    labels[outside & ~unlike] = cv2.GC_BGD
    bare = cv2.erode((like & ~within).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    near = (
        cv2.dilate(np.isin(labels, _OBJECT).astype(np.uint8), np.ones((_FEET_REACH,) * 2, np.uint8))
        > 0
    )
    labels[bare & ~(imprint & near)] = cv2.GC_BGD
    labels[~box] = cv2.GC_BGD
    return labels, ~np.isnan(contrast)


def _by_depth(
    depths: Depths, region: Region, index: int, shape: tuple[int, int]
) -> tuple[Bool[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]:
    """Return masks of depth inside the box and above the floor, and of depth clearly outside of that."""
    view = depths.pictures.views[index]
    T = inverse(region.T_world_floor) @ view.T_world_camera
    within, outside = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    for maps in depths.kinds:
        depth = maps[index]
        places = pixel_rays(depth.shape, matrix_for(view, depth.shape[::-1])) * depth[..., None]
        places = places @ T[:3, :3].T.astype(np.float32) + T[:3, 3].astype(np.float32)
        known = depth > 0
        inside = ((places > region.low) & (places < region.high)).all(axis=-1)
        near = ((places > region.low - _BEYOND) & (places < region.high + _BEYOND)).all(axis=-1)
        here = known & inside & (places[..., 2] > _OVER_FLOOR)
        away = known & ~near
        within |= _larger(here, shape)
        outside |= _larger(away, shape)
    return within, outside & ~within


def _larger(mask: Bool[np.ndarray, "h w"], shape: tuple[int, int]) -> Bool[np.ndarray, "h2 w2"]:
    size = (shape[1], shape[0])
    return cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST_EXACT) > 0


def _box(pictures: SmallPictures, region: Region, index: int) -> Bool[np.ndarray, "h w"]:
    """The pixels that may show the object."""
    pick = np.indices((2, 2, 2)).reshape(3, -1).T
    T = inverse(pictures.views[index].T_world_camera) @ region.T_world_floor
    corners = np.where(pick, region.high, region.low) @ T[:3, :3].T + T[:3, 3]
    width, height = pictures.size(index)
    mask = np.zeros((height, width), np.uint8)
    if (corners[:, 2] < 0.05).any():
        return np.ones((height, width), np.bool_)
    places = corners @ pictures.matrix(index).T
    hull = cv2.convexHull((places[:, :2] / places[:, 2:]).astype(np.float32))
    cv2.fillConvexPoly(mask, np.rint(hull).astype(np.int32), 1)
    return mask > 0
