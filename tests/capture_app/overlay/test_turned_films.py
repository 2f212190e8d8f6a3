"""Films of a tripod that say that they are to be shown turned or mirrored."""

from pathlib import Path

import numpy as np
import pytest

from capture_app.overlay.overlay_film import on_tripod
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.film import Turning
from ingest.scan.scan_pictures import is_mirrored
from ingest.scan.scan_sources import video_source
from tests.stamped_film import film

CLOCKWISE = [0, 1, 0, -1, 0, 0, 0, 0, 1]
"""As a phone held upright writes it: to be shown turned by 90 degrees clockwise (ISO 14496-12)."""
MIRRORED_CLOCKWISE = [0, 1, 0, 1, 0, 0, 0, 0, 1]
HALF = [-1, 0, 0, 0, -1, 0, 0, 0, 1]
MIRRORED = [-1, 0, 0, 0, 1, 0, 0, 0, 1]


def camera(width: int, height: int) -> WitnessCamera:
    return WitnessCamera(50.0, 50.0, (width - 1) / 2, (height - 1) / 2, size=(width, height))


def white(picture: np.ndarray) -> tuple[str, str]:
    """The corner with the white patch, which is at the top left of the stored pictures."""
    height, width = picture.shape[:2]
    corners = {("top", "left"): picture[4, 4], ("top", "right"): picture[4, width - 5],
               ("bottom", "left"): picture[height - 5, 4],
               ("bottom", "right"): picture[height - 5, width - 5]}  # fmt: skip
    return max(corners, key=lambda name: int(corners[name].mean()))


@pytest.mark.parametrize(
    ("matrix", "size", "corner", "left"),
    [
        (CLOCKWISE, (64, 48), ("top", "left"), Turning(3)),
        (CLOCKWISE, (48, 64), ("top", "right"), Turning(0)),
        (MIRRORED, (64, 48), ("top", "left"), Turning(0, mirrored=True)),
        (MIRRORED_CLOCKWISE, (48, 64), ("top", "right"), Turning(0, mirrored=True)),
        (HALF, (64, 48), ("top", "left"), Turning(2)),
    ],
)
def test_pictures_are_as_the_camera_was_calibrated(
    tmp_path: Path, matrix, size, corner, left: Turning
):
    path = film(tmp_path / "a.mov", [0, 1, 2], matrix=matrix)
    seen = on_tripod(path, camera(*size)).film
    picture = next(seen.read(0, 1))[1]
    assert (seen.size, picture.shape[:2]) == (size, size[::-1])
    assert white(picture) == corner
    assert seen.shown == left


def test_the_place_tells_which_pictures_of_a_half_turn_it_is_for(tmp_path: Path):
    path = film(tmp_path / "a.mov", [0, 1, 2], matrix=HALF)
    level = np.eye(4)
    level[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # upright pictures look along y of the world
    shown = on_tripod(path, camera(64, 48), level).film
    assert white(next(shown.read(0, 1))[1]) == ("bottom", "right")
    assert shown.shown == Turning()
    stored = on_tripod(path, camera(64, 48), level @ np.diag([-1.0, -1, 1, 1])).film
    assert white(next(stored.read(0, 1))[1]) == ("top", "left")
    assert stored.shown == Turning(2)


@pytest.mark.parametrize(
    ("matrix", "corner"), [(MIRRORED, ("top", "left")), (MIRRORED_CLOCKWISE, ("top", "right"))]
)
def test_a_scan_takes_a_mirrored_film_as_the_camera_saw_it(tmp_path: Path, matrix, corner):
    path = film(tmp_path / "a.mov", [0, 1, 2], matrix=matrix)
    assert white(dict(video_source(path).pictures.colours([1]))[1]) == corner


def test_a_photo_says_that_it_is_mirrored(tmp_path: Path):
    """EXIF 2.3: 2, 4, 5 and 7 are shown mirrored."""
    from PIL import Image

    for value in range(1, 9):
        exif = Image.Exif()
        exif[0x0112] = value
        Image.new("RGB", (8, 8)).save(tmp_path / "a.jpg", exif=exif)
        assert is_mirrored(tmp_path / "a.jpg") == (value in (2, 4, 5, 7))
