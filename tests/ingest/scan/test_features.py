"""Features of pictures: as many as asked for, and fewer and larger ones for a draft."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.colmap import pycolmap
from ingest.scan.cameras.features import find_features
from ingest.scan.scan_types import Frame, no_progress


def _filmed(folder: Path, width: int) -> Frame:
    """A picture full of shapes of all sizes."""
    rng, size = np.random.default_rng(0), (width, width * 3 // 4)
    picture = np.full((size[1], size[0], 3), 120, np.uint8)
    for _ in range(4000):
        at, colour = rng.integers(0, size).tolist(), rng.integers(0, 255, 3).tolist()
        cv2.rectangle(picture, at, (np.array(at) + rng.integers(4, 40, 2)).tolist(), colour, -1)
    file = folder / "00000.jpg"
    cv2.imwrite(str(file), picture)
    return Frame(file.name, file, size, np.array([width, width, width / 2, width * 3 / 8]))


def _sizes(folder: Path, frame: Frame, *, draft: bool) -> np.ndarray:
    """Of the features that are found, pixels."""
    database = folder / f"{draft}.db"
    numbers = find_features(database, folder, [frame], no_progress, draft=draft)
    with pycolmap.Database.open(database) as opened:
        points = opened.read_keypoints(numbers[frame.name])
    return np.hypot(points[:, 2], points[:, 4])


@pytest.mark.parametrize(("width", "finest"), [(1000, 1.0), (1600, 1.9)])
def test_a_draft_finds_fewer_and_in_large_pictures_none_of_the_finest(
    tmp_path: Path, width: int, finest: float
):
    frame = _filmed(tmp_path, width)
    whole, draft = (_sizes(tmp_path, frame, draft=draft) for draft in (False, True))
    assert 100 < len(draft) < len(whole) / 2
    assert draft.min() > finest * whole.min()
