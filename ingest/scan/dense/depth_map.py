"""Depth of every pixel of a view, out of its neighbours, and what several views agree about."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int16, UInt8, UInt16

from ingest.scan.dense.matching import Neighbour, fine_codes, match_cost
from ingest.scan.dense.picture import SmallPictures
from omomo_core.geometry.transforms import inverse

_FEWEST_DEPTHS, _MOST_DEPTHS = 48, 144
_PIXELS = 1.0
"""Between the places in a neighbour of two depths that follow each other, about."""

DepthMap = Float32[np.ndarray, "h w"]
"""Metres along the viewing axis, 0 where unknown."""
DepthMaps = Sequence[Float32[np.ndarray, "_ _"]]
"""Those of several views or of several ways of measuring, whose sizes may differ."""
_STEP, _LEAP = 6, 48
"""What it costs that a pixel lies one depth, or many, from the one beside it."""
_EDGE = 8
"""Difference of grey levels beyond which a leap costs less: surfaces end where colours change."""

Costs = UInt16[np.ndarray, "lanes depths"]


def stereo_depth(
    pictures: SmallPictures, index: int, others: Sequence[int], span: tuple[float, float]
) -> DepthMap:
    """Depth of a view by matching it with others.

    Args:
        pictures: of all the views.
        index: of the view.
        others: its neighbours, at least one.
        span: nearest and farthest depth, metres.
    """
    view = pictures.views[index]
    neighbours = [
        Neighbour(
            fine_codes(pictures.picture(other).grey),
            pictures.matrix(other),
            inverse(pictures.views[other].T_world_camera) @ view.T_world_camera,
        )
        for other in others
    ]
    matrix = pictures.matrix(index)
    depths = _depths(matrix, neighbours, span)
    grey = pictures.picture(index).grey
    return _cheapest(smoothed(match_cost(grey, matrix, neighbours, depths), grey), depths)


def _depths(
    matrix: Float64[np.ndarray, "3 3"], neighbours: Sequence[Neighbour], span: tuple[float, float]
) -> Float64[np.ndarray, " depths"]:
    """Depths whose inverses are evenly spread, as what is seen of them is."""
    near, far = 1 / span[0], 1 / span[1]
    baseline = float(np.median([np.linalg.norm(n.T_neighbour_view[:3, 3]) for n in neighbours]))
    count = int(matrix[0, 0] * baseline * (near - far) / _PIXELS)
    return 1 / np.linspace(near, far, min(max(count, _FEWEST_DEPTHS), _MOST_DEPTHS))


def _cheapest(
    costs: UInt16[np.ndarray, "h w depths"], depths: Float64[np.ndarray, " depths"]
) -> DepthMap:
    """The best depth of each pixel, between two where that is better; 0 where it is at either end."""
    last = len(depths) - 1
    best = costs.argmin(axis=2)
    inside = best.clip(1, last - 1)
    before, at, after = (
        np.take_along_axis(costs, (inside + step)[..., None], axis=2)[..., 0].astype(np.float32)
        for step in (-1, 0, 1)
    )
    bend = np.maximum(before + after - 2 * at, 1.0)
    between = inside + ((before - after) / (2 * bend)).clip(-0.5, 0.5)
    depth = 1 / np.interp(between, np.arange(last + 1), 1 / depths)
    return np.where((best > 0) & (best < last), depth, 0).astype(np.float32)


def agreed(
    depth: DepthMap,
    matrix: Float64[np.ndarray, "3 3"],
    others: Sequence[tuple[DepthMap, Float64[np.ndarray, "3 3"], Float64[np.ndarray, "4 4"]]],
    *,
    within: float,
    enough: int,
) -> DepthMap:
    """Depth that other views confirm, averaged with theirs; 0 elsewhere.

    Args:
        depth, matrix: of the view and its intrinsics.
        others: depth map, intrinsics and T_other_view of other views.
        within: part of the depth by which they may differ.
        enough: how many must confirm a depth.
    """
    rays = pixel_rays(depth.shape, matrix)
    confirmed = np.zeros(depth.shape, np.uint8)
    total = np.ones(depth.shape, np.float32)
    for other, other_matrix, T in others:
        seen, expected = _seen_from(rays * depth[..., None], other, other_matrix, T)
        ratio = seen / expected
        close = (depth > 0) & (seen > 0) & (np.abs(ratio - 1) < within)
        confirmed += close
        total += np.where(close, ratio, 0)
    return np.where(confirmed >= enough, depth * total / (1 + confirmed), 0).astype(np.float32)


def pixel_rays(
    shape: tuple[int, ...], matrix: Float64[np.ndarray, "3 3"]
) -> Float32[np.ndarray, "h w 3"]:
    """Points at depth 1 that pixels show, in the camera's frame."""
    v, u = np.indices(shape, np.float32)
    (fx, _, cx), (_, fy, cy) = matrix[0], matrix[1]
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones_like(u)], axis=-1)
    return rays.astype(np.float32)


def _seen_from(
    points: Float32[np.ndarray, "h w 3"],
    depth: DepthMap,
    matrix: Float64[np.ndarray, "3 3"],
    T_other_view: Float64[np.ndarray, "4 4"],
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Depth that another view has where it should see points, and the depth it should have."""
    T = T_other_view.astype(np.float32)
    there = points @ T[:3, :3].T + T[:3, 3]
    z = np.maximum(there[..., 2], np.float32(1e-3))
    u = there[..., 0] / z * np.float32(matrix[0, 0]) + np.float32(matrix[0, 2])
    v = there[..., 1] / z * np.float32(matrix[1, 1]) + np.float32(matrix[1, 2])
    seen = cv2.remap(depth, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    return np.asarray(seen, np.float32), z


def smoothed(
    costs: UInt8[np.ndarray, "h w depths"], grey: UInt8[np.ndarray, "h w"]
) -> UInt16[np.ndarray, "h w depths"]:
    """Costs of each pixel's depths together with what they cost the pixels around it."""
    total = np.zeros(costs.shape, np.uint16)
    light = grey.astype(np.int16)
    _sweep(costs, light, total)
    # Columns instead of rows: views on the same memory.
    _sweep(costs.swapaxes(0, 1), light.T, total.swapaxes(0, 1))
    return total


def _sweep(
    costs: UInt8[np.ndarray, "n lanes depths"],
    grey: Int16[np.ndarray, "n lanes"],
    total: UInt16[np.ndarray, "n lanes depths"],
) -> None:
    """Add the costs of paths along the first axis, there and back."""
    for order in (range(len(costs)), range(len(costs) - 1, -1, -1)):
        for index, path in _paths(costs, grey, order):
            total[index] += path


def _paths(
    costs: UInt8[np.ndarray, "n lanes depths"], grey: Int16[np.ndarray, "n lanes"], order: range
) -> Iterator[tuple[int, Costs]]:
    before = costs[order[0]].astype(np.uint16)
    yield order[0], before
    for last, index in pairwise(order):
        least = before.min(axis=1, keepdims=True)
        change = np.maximum(np.abs(grey[index] - grey[last]), _EDGE)
        leap = np.maximum(_LEAP * _EDGE // change, _STEP + 2).astype(np.uint16)
        best = np.minimum(before, least + leap[:, None])
        np.minimum(best[:, 1:], before[:, :-1] + np.uint16(_STEP), out=best[:, 1:])
        np.minimum(best[:, :-1], before[:, 1:] + np.uint16(_STEP), out=best[:, :-1])
        before = costs[index] + best - least
        yield index, before
