"""FloorBackground: what the bare floor looks like, so that whatever stands before it is told from it.

Every place of the floor is hidden by the object in some pictures only, and its shadow lies on the floor
in all of them; the median over the pictures is the floor without the object (background subtraction,
with the parallax of the film in the place of a still camera).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64

from ingest.scan.dense.depth_map import DepthMap, pixel_rays
from ingest.scan.dense.depths import Depths
from ingest.scan.dense.picture import SmallPictures, at_pixels, matrix_for, projected
from ingest.scan.types import Region
from omomo_core.geometry.transforms import inverse

_CELLS = 520
"""Along each side of the map of the floor."""
_REACH = 1.3
"""Sizes of the object by which the map goes beyond its box on every side."""
_VIEWS = 36
"""Pictures that the map is made of, at most."""
_ABOVE = 0.06
"""Metres before the floor at which depth says that something hides it."""
_FEWEST = 3
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
    half = size[:2].max() / 2 + _REACH * float(size.max())
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
    return (shown > 0) & (shown < z - _ABOVE)


def _median(
    values: np.ndarray,
) -> tuple[Float32[np.ndarray, "points 3"], Bool[np.ndarray, " points"]]:
    """Lower median over the pictures that show a place, and whether enough do."""
    count = (values[..., 0] < _HIDDEN).sum(axis=0)
    middle = ((count - 1).clip(0) // 2)[None, :, None]
    median = np.take_along_axis(np.sort(values, axis=0), middle, axis=0)[0]
    known = count >= _FEWEST
    return np.where(known[:, None], median, 0).astype(np.float32), known
