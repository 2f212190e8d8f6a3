"""Small pictures of a scan's views, loaded when they are needed, with intrinsics to fit."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Shaped, UInt8

from ingest.scan.types import View
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

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
