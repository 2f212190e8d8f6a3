"""stereo_maps: a depth map of every view, kept in the work folder so that a scan can go on."""

import hashlib
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64

from ingest.scan.dense.depth_map import DepthMap, DepthMaps, agreed, stereo_depth
from ingest.scan.dense.picture import SmallPictures
from ingest.scan.region.aim import Aim
from ingest.scan.types import Progress, Registered, View
from omomo_core.geometry.transforms import inverse

_MATCHED = 4
"""Neighbours that a view is matched with."""
_ASKED = 6
"""Views that are asked whether they see the same."""
_ENOUGH, _MANY = 2, 4
"""How many of them must; one is enough where there are fewer than that."""
_PIXELS = 4.4
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
        within = _PIXELS / float(matrix[0, 0])
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
