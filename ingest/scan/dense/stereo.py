"""Depth maps by plane-sweep stereo on small pictures.

Census codes (Zabih and Woodfill 1994) do not mind what exposure does to a picture; a plane sweep
(Collins 1996) needs no rectified pairs, so neighbours may stand anywhere.
"""

import hashlib
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int16, Int64, Shaped, UInt8, UInt16

from ingest.scan.region import Aim
from ingest.scan.scan_types import Progress, Registered, View
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_REACH = 2
"""Pixels around each one that its code compares it with: 5 x 5."""
_FINE = 2
"""Neighbours are enlarged so many times, as their codes cannot be interpolated."""
_UNSEEN = 40
"""What a pixel costs where a neighbour does not show it: as much as two of noise."""
_MOST_GREY = 48
Codes = UInt8[np.ndarray, "rows columns 4"]
"""24 comparisons of each pixel with those around it, and its own grey."""


@dataclass(frozen=True)
class Neighbour:
    """Another view, as one view sees it."""

    codes: Codes
    """Codes of its enlarged picture."""
    matrix: Float64[np.ndarray, "3 3"]
    """Its intrinsics."""
    T_neighbour_view: Float64[np.ndarray, "4 4"]


def fine_codes(grey: UInt8[np.ndarray, "h w"]) -> Codes:
    """Codes of a neighbour, enlarged."""
    large = cv2.resize(grey, None, fx=_FINE, fy=_FINE, interpolation=cv2.INTER_LINEAR)
    return _codes(np.asarray(large, np.uint8), _FINE)


def match_cost(
    grey: UInt8[np.ndarray, "h w"],
    matrix: Float64[np.ndarray, "3 3"],
    neighbours: Sequence[Neighbour],
    depths: Float64[np.ndarray, " depths"],
) -> UInt8[np.ndarray, "h w depths"]:
    """Cost of every depth of every pixel, 0 to HIGHEST.

    It is the mean of the two neighbours that match best: what is hidden from one is often seen by
    another.

    Args:
        grey, matrix: the picture and its intrinsics.
        neighbours: at least one.
        depths: metres along the viewing axis.
    """
    own = _codes(grey, 1)
    back = np.linalg.inv(matrix)
    costs = np.empty((*grey.shape, len(depths)), np.uint8)
    for index, depth in enumerate(depths):
        single = [_one_cost(own, neighbour, back, float(depth)) for neighbour in neighbours]
        best, second = single[0], single[min(1, len(single) - 1)]
        best, second = np.minimum(best, second), np.maximum(best, second)
        for other in single[2:]:
            second = np.minimum(second, np.maximum(best, other))
            best = np.minimum(best, other)
        costs[..., index] = (best + second) >> 1
    return costs


def _codes(grey: UInt8[np.ndarray, "h w"], step: int) -> Codes:
    rim = _REACH * step
    h, w = grey.shape
    around = cv2.copyMakeBorder(grey, rim, rim, rim, rim, cv2.BORDER_REPLICATE)
    codes = np.zeros((h, w, 4), np.uint8)
    places = [(y, x) for y in range(0, 2 * rim + 1, step) for x in range(0, 2 * rim + 1, step)]
    places.remove((rim, rim))
    for bit, (y, x) in enumerate(places):
        darker = (around[y : y + h, x : x + w] < grey).astype(np.uint8)
        codes[..., bit // 8] |= darker << np.uint8(bit % 8)
    # 0 is left for what lies beyond the picture.
    codes[..., 3] = np.maximum(grey, 1)
    return codes


def _one_cost(
    own: Codes, neighbour: Neighbour, back: Float64[np.ndarray, "3 3"], depth: float
) -> UInt8[np.ndarray, "h w"]:
    """Cost for a plane that faces the view."""
    T = neighbour.T_neighbour_view
    plane = T[:3, :3].copy()
    plane[:, 2] += T[:3, 3] / depth
    enlarged = np.array([[_FINE, 0, (_FINE - 1) / 2], [0, _FINE, (_FINE - 1) / 2], [0, 0, 1]])
    seen = cv2.warpPerspective(
        neighbour.codes,
        enlarged @ neighbour.matrix @ plane @ back,
        (own.shape[1], own.shape[0]),
        flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(0, 0, 0, 0),
    )
    # The grey's byte is beyond the 24 bits that are compared.
    differ = (_words(seen) ^ _words(own)) & np.uint32(0xFFFFFF)
    grey = seen[..., 3]
    unlike = np.minimum(cv2.absdiff(np.ascontiguousarray(grey), own[..., 3].copy()), _MOST_GREY)
    cost = (np.bitwise_count(differ) << 1) + (unlike >> 1)
    np.putmask(cost, grey == 0, _UNSEEN)
    return cost


def _words(codes: np.ndarray) -> np.ndarray:
    return codes.view("<u4")[..., 0]


_KEPT = 24
"""Pictures in memory at a time: 90 MB of them."""


_ROW = 4096


@dataclass(frozen=True)
class SmallPicture:
    """A picture of a view, made smaller."""

    colours: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue."""
    grey: UInt8[np.ndarray, "h w"]


class SmallPictures:
    """The views of a scan with pictures of one width; the latest used stay in memory."""

    def __init__(self, views: Sequence[View], width: int) -> None:
        """Nothing is read yet; a view with a smaller picture keeps its size."""
        self.views = tuple(views)
        self._width = width
        self._loaded = lru_cache(_KEPT)(self._load)

    def size(self, index: int) -> tuple[int, int]:
        """Width and height."""
        width, height = self.views[index].size
        factor = min(1.0, self._width / width)
        return round(width * factor), round(height * factor)

    def matrix(self, index: int) -> Float64[np.ndarray, "3 3"]:
        """Intrinsics (pixel centres at whole numbers)."""
        return matrix_for(self.views[index], self.size(index))

    def picture(self, index: int) -> SmallPicture:
        """The picture of a view.

        Raises:
            InputError: "scan-picture" when its file is gone or damaged.
        """
        return self._loaded(index)

    def _load(self, index: int) -> SmallPicture:
        stored = _stored(self.views[index].file)
        small = cv2.resize(stored, self.size(index), interpolation=cv2.INTER_AREA)
        grey = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY)
        colours = cv2.cvtColor(small, cv2.COLOR_BGR2RGB)
        return SmallPicture(np.asarray(colours, np.uint8), np.asarray(grey, np.uint8))


def matrix_for(view: View, size: tuple[int, int]) -> Float64[np.ndarray, "3 3"]:
    """Intrinsics of a view for a copy of its picture (or its depth map) of another size."""
    fx, fy, cx, cy = view.intrinsics
    x, y = size[0] / view.size[0], size[1] / view.size[1]
    # Pixel centres stand at whole numbers, so half a pixel is added before scaling.
    return np.array(
        [
            [fx * x, 0.0, (cx + 0.5) * x - 0.5],
            [0.0, fy * y, (cy + 0.5) * y - 0.5],
            [0.0, 0.0, 1.0],
        ]
    )


def projected(
    points: Float64[np.ndarray, "points 3"],
    T_world_camera: Float64[np.ndarray, "4 4"],
    matrix: Float64[np.ndarray, "3 3"],
) -> Float32[np.ndarray, "3 points"]:
    """u, v and depth of points of the world; far outside the picture where they are not ahead."""
    P = matrix @ inverse(T_world_camera)[:3]
    u, v, z = P[:, :3] @ points.T + P[:, 3:]
    ahead = z > 1e-3
    scale = 1 / np.where(ahead, z, 1.0)
    return np.stack([np.where(ahead, u * scale, -1e4), np.where(ahead, v * scale, -1e4), z]).astype(
        np.float32
    )


def at_pixels(
    image: Shaped[np.ndarray, "h w *channels"],
    u: Float32[np.ndarray, " points"],
    v: Float32[np.ndarray, " points"],
    interpolation: int,
) -> Shaped[np.ndarray, " points *channels"]:
    """Values of an image at many places, 0 beyond it; `interpolation` is one of OpenCV's."""
    # OpenCV takes no maps of more than 32,767 rows, so the places make a picture of their own.
    rows = -(-len(u) // _ROW)
    maps = [np.resize(x, (rows, _ROW)) for x in (u, v)] if rows else []
    if not maps:
        return np.empty((0, *image.shape[2:]), image.dtype)
    found = cv2.remap(image, maps[0], maps[1], interpolation, borderValue=(0, 0, 0, 0))
    return np.asarray(found).reshape(-1, *image.shape[2:])[: len(u)]


def _stored(file: Path) -> UInt8[np.ndarray, "h w 3"]:
    stored = cv2.imread(str(file), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if stored is None:
        raise InputError(
            "scan-picture",
            "A picture of the scan is missing or damaged.",
            where=str(file),
            fix="Remove the scan's work folder and scan again.",
        )
    return np.asarray(stored, np.uint8)


_FEWEST_DEPTHS, _MOST_DEPTHS = 48, 144
_STEP_PIXELS = 1.0
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
    count = int(matrix[0, 0] * baseline * (near - far) / _STEP_PIXELS)
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


_MATCHED = 4
"""Neighbours that a view is matched with."""
_ASKED = 6
"""Views that are asked whether they see the same."""
_ENOUGH, _MANY = 2, 4
"""How many of them must; one is enough where there are fewer than that."""
_DISPARITY_STEP = 4.4
"""Depths may differ by this part over the focal length in pixels: about one pixel of disparity."""
_WORKERS = 4
"""At most: each needs some 150 MB."""
_FEW_POINTS = 50
"""A view with fewer sparse points takes the depths of all of them."""
_METHOD = "census-sgm-1"
"""Changes with what the maps hold, so that old ones are not taken up again."""
_BEST_ANGLE = np.radians(12)
"""Between the ways to a point: more is more precise, less looks more alike."""
_NARROWEST, _WIDEST = np.radians(3), np.radians(35)
_APART = np.radians(5)
"""Between neighbours, so that what one does not see another may."""
_RIM = 0.5
"""Percent of the sparse points that may be mistakes, at either end."""
_NEARER, _FARTHER = 0.75, 1.3
"""Depths of a view begin and end at so much of its nearest and farthest points."""
_NEAREST = 0.15
"""Metres."""


def stereo_maps(
    registered: Registered, pictures: SmallPictures, aim: Aim, work: Path, progress: Progress
) -> DepthMaps:
    """Depth of the views by matching, as far as others confirm it; metres, 0 elsewhere.

    Args:
        registered: cameras and sparse points.
        pictures: of the registered views.
        aim: where they look.
        work: folder that keeps what is measured; what it already has is not measured again.
        progress: called with the stage "stereo".
    """
    folder = work / "stereo" / _key(registered, pictures)
    folder.mkdir(parents=True, exist_ok=True)
    todo = [k for k in range(len(registered.views)) if not _file(folder, k).is_file()]
    seen = _points_seen(registered)

    def measure(index: int) -> None:
        others = neighbours(registered.views, aim.point, index, _MATCHED)
        mine = seen[index] if len(seen[index]) >= _FEW_POINTS else slice(None)
        span = depth_range(registered.views[index], registered.points[mine])
        empty = np.zeros(pictures.size(index)[::-1], np.float32)
        _save(folder, index, stereo_depth(pictures, index, others, span) if others else empty)

    with ThreadPoolExecutor(min(_WORKERS, os.cpu_count() or 1)) as pool:
        jobs = [pool.submit(measure, index) for index in todo]
        try:
            for done, job in enumerate(as_completed(jobs), len(registered.views) - len(todo) + 1):
                job.result()
                progress("stereo", done / len(registered.views))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    maps = [np.load(_file(folder, k), allow_pickle=False) for k in range(len(registered.views))]
    return _agreed(maps, pictures, aim)


def _agreed(maps: Sequence[DepthMap], pictures: SmallPictures, aim: Aim) -> DepthMaps:
    kept: list[DepthMap] = []
    for index, depth in enumerate(maps):
        T_world_view = pictures.views[index].T_world_camera
        others = [
            (
                maps[other],
                pictures.matrix(other),
                inverse(pictures.views[other].T_world_camera) @ T_world_view,
            )
            for other in neighbours(pictures.views, aim.point, index, _ASKED)
        ]
        matrix = pictures.matrix(index)
        within = _DISPARITY_STEP / float(matrix[0, 0])
        enough = _ENOUGH if len(others) >= _MANY else 1
        kept.append(agreed(depth, matrix, others, within=within, enough=enough))
    return kept


def _key(registered: Registered, pictures: SmallPictures) -> str:
    """Changes with everything that the maps depend on."""
    digest = hashlib.sha256(_METHOD.encode())
    for index, view in enumerate(registered.views):
        digest.update(view.name.encode())
        digest.update(np.asarray(pictures.size(index)).tobytes())
        digest.update(view.intrinsics.tobytes() + view.T_world_camera.tobytes())
        digest.update(str(view.file.stat().st_mtime_ns).encode() if view.file.exists() else b"")
    digest.update(registered.points.tobytes())
    return digest.hexdigest()[:16]


def _file(folder: Path, index: int) -> Path:
    return folder / f"{index:05d}.npy"


def _save(folder: Path, index: int, depth: DepthMap) -> None:
    """Whole or not at all: a scan that was stopped does not go on with half a map."""
    partial = folder / f".{index:05d}.partial"
    with partial.open("wb") as file:
        np.save(file, depth, allow_pickle=False)
    partial.replace(_file(folder, index))


def neighbours(
    views: Sequence[View], aim: Float64[np.ndarray, "3"], index: int, count: int
) -> list[int]:
    """Up to `count` views that see the aim from well chosen other directions, the best first."""
    away = aim - np.stack([view.T_world_camera[:3, 3] for view in views])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    between = np.arccos(np.clip(away @ away.T, -1.0, 1.0))
    fits = (between[index] > _NARROWEST) & (between[index] < _WIDEST)
    chosen: list[int] = []
    for other in np.argsort(np.abs(between[index] - _BEST_ANGLE)):
        if fits[other] and all(between[other, taken] > _APART for taken in chosen):
            chosen.append(int(other))
        if len(chosen) == count:
            break
    return chosen


def depth_range(view: View, points: Float64[np.ndarray, "points 3"]) -> tuple[float, float]:
    """Nearest and farthest depth that a view may show, metres, from sparse points that it sees."""
    eye, axis = view.T_world_camera[:3, 3], view.T_world_camera[:3, 2]
    near, far = np.percentile((points - eye) @ axis, (_RIM, 100 - _RIM))
    return max(_NEARER * float(near), _NEAREST), _FARTHER * max(float(far), 2 * _NEAREST)


def _points_seen(registered: Registered) -> list[Int64[np.ndarray, " seen"]]:
    """Indices of the sparse points that each view shows."""
    return [
        registered.observed[registered.observed[:, 1] == view, 0]
        for view in range(len(registered.views))
    ]
