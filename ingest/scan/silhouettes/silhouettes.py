"""find_silhouettes: which pixels of each picture show the object.

Labels come from what is sure (the box, depth, the look of the bare floor); GrabCut (Rother, Kolmogorov and
Blake 2004) settles the rest by colours and edges.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from ingest.scan.dense.depth_map import pixel_rays
from ingest.scan.dense.depths import Depths
from ingest.scan.dense.picture import SmallPictures, matrix_for
from ingest.scan.silhouettes.floor_background import FloorBackground, floor_background
from ingest.scan.types import Progress, Region, no_progress
from omomo_core.geometry.transforms import inverse

_LIKE, _UNLIKE = 2.0, 3.5
"""Standard deviations up to which a pixel is like the bare floor, and from which it is not."""
_SURE = 5.0
"""Standard deviations from which a pixel is the object for sure. GrabCut alone loses thin poles before things
of their colour."""
_ABOVE = 0.04
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
_FEWEST = 40
"""Pixels that must be the object's for sure, and of the background."""

_REACH = 21
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
    if object_like.sum() < _FEWEST or (~object_like).sum() < _FEWEST:
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
        cv2.dilate(np.isin(labels, _OBJECT).astype(np.uint8), np.ones((_REACH,) * 2, np.uint8)) > 0
    )
    labels[bare & ~(imprint & near)] = cv2.GC_BGD
    labels[~box] = cv2.GC_BGD
    return labels, ~np.isnan(contrast)


def _by_depth(
    depths: Depths, region: Region, index: int, shape: tuple[int, int]
) -> tuple[Bool[np.ndarray, "h w"], Bool[np.ndarray, "h w"]]:
    """Where depth lies in the box and above the floor, and where it lies clearly outside of that."""
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
        here = known & inside & (places[..., 2] > _ABOVE)
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
