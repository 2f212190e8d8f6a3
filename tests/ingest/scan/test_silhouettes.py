"""The object is told from the floor by what the floor looks like without it."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.scan.dense.depth_maps import Depths
from ingest.scan.dense.stereo import SmallPictures
from ingest.scan.scan_types import Region, View
from ingest.scan.silhouettes import BACKGROUND, OBJECT, find_silhouettes
from omomo_core.geometry.transforms import inverse
from tests.ingest.scan.orbiting import K, ring

SIZE = (320, 240)
HALF = K / 2
LOW, HIGH = np.array([-0.15, -0.15, 0.0]), np.array([0.15, 0.15, 0.5])
REGION = Region(np.eye(4), LOW - [0.05, 0.05, 0.0], HIGH + 0.05)
MATRIX = np.array([[HALF[0], 0, HALF[2]], [0, HALF[1], HALF[3]], [0, 0, 1.0]])


def _floor_of(T, dark=False):
    """A patterned floor as a camera sees it, maybe with dark stripes."""
    v, u = np.indices(SIZE[::-1]).astype(float)
    rays = np.stack([(u - HALF[2]) / HALF[0], (v - HALF[3]) / HALF[1], np.ones_like(u)], axis=-1)
    ways = rays @ T[:3, :3].T
    far = -T[2, 3] / np.minimum(ways[..., 2], -1e-3)
    x, y = (T[k, 3] + far * ways[..., k] for k in (0, 1))
    light = 120 + 25 * np.sin(9 * x) + 20 * np.cos(7 * y)
    if dark:
        light = np.where(y % 0.12 < 0.04, 27, light)
    return np.repeat(light[..., None], 3, axis=-1).clip(0, 255).astype(np.uint8)


def _pole(T):
    """Where a camera sees a pole of 3 cm that stands in the middle."""
    mask = np.zeros(SIZE[::-1], np.uint8)
    corners = np.array([[a, b, z] for a in (-1, 1) for b in (-1, 1) for z in (0, 25)]) * [
        0.015,
        0.015,
        0.02,
    ]
    P = MATRIX @ inverse(T)[:3]
    u, v, z = P[:, :3] @ corners.T + P[:, 3:]
    hull = cv2.convexHull(np.stack([u / z, v / z], axis=1).astype(np.float32))
    cv2.fillConvexPoly(mask, np.rint(hull).astype(np.int32), 1)
    return mask


@pytest.fixture(scope="module", params=["light floor", "dark stripes"])
def filmed(request, tmp_path_factory):
    folder, dark = tmp_path_factory.mktemp("pole"), request.param == "dark stripes"
    views, truth = [], []
    for index, T in enumerate(ring([0.0, 0.0, 0.2], count=12, elevations=(0.6, 0.9))):
        picture, mask = _floor_of(T, dark), _pole(T)
        picture[mask > 0] = (25, 25, 30)
        # Some pictures are brighter than others.
        picture = np.clip(picture * (0.9 + 0.02 * index), 0, 255).astype(np.uint8)
        file: Path = folder / f"{index}.png"
        cv2.imwrite(str(file), picture)
        views.append(View(file.name, file, SIZE, HALF, T))
        truth.append(mask)
    return views, truth


def test_a_dark_pole_without_depth_is_found(filmed):
    views, truth = filmed
    pictures = SmallPictures(views, SIZE[0])
    blind = [np.zeros((24, 32), np.float32) for _ in views]
    masks = find_silhouettes(pictures, Depths(pictures, (blind,), "depth"), REGION)
    for mask, true in zip(masks, truth, strict=True):
        assert mask is not None
        found = mask == OBJECT
        assert found[true > 0].mean() > 0.75
        assert (found & (cv2.dilate(true, np.ones((5, 5))) == 0)).sum() < 0.2 * true.sum()
        assert (mask == BACKGROUND).mean() > 0.5
