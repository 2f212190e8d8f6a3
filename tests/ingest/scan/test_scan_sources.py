"""What is given for a scan: told by its content, read lazily, refused with a way out."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from ingest.scan.scan_sources import focal_of, read_source
from omomo_core.errors import InputError


def _picture(seed: int, size: tuple[int, int] = (64, 48)) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return cv2.resize(rng.integers(0, 255, (6, 8, 3), np.uint8), size)


def test_a_folder_of_photos_with_their_focal_lengths(tmp_path: Path):
    for k in range(3):
        Image.fromarray(_picture(k)).save(tmp_path / f"IMG_{k}.JPG", exif=_exif(26, 1))
    (tmp_path / "notes.txt").write_text("not a photo")
    source = read_source(tmp_path)
    assert source.kind == "photos"
    assert list(source.pictures.names) == ["IMG_0", "IMG_1", "IMG_2"]
    assert source.focal_guess is not None
    # 26 mm on a film of 43.3 mm across; here across is 80 of 64 pixels.
    np.testing.assert_allclose(source.focal_guess, 26 / 43.27 * 80 / 64, rtol=1e-3)


def _exif(focal: int, orientation: int) -> Image.Exif:
    exif = Image.Exif()
    exif[0x0112] = orientation
    exif.get_ifd(0x8769)[0xA405] = focal
    return exif


def test_photos_are_turned_upright_as_they_say(tmp_path: Path):
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:24, :32] = 255
    for orientation in (1, 6):
        file = tmp_path / f"{orientation}.jpg"
        Image.fromarray(picture).save(file, exif=_exif(26, orientation), quality=95)
    found = dict(read_source(tmp_path).pictures.colours([0, 1]))
    assert found[0].shape == (48, 64, 3)
    # 6: the stored top is the right-hand side of the picture.
    assert found[1].shape == (64, 48, 3)
    assert found[1][10, 40].mean() > 250
    assert found[1][10, 10].mean() < 5


def test_photos_without_exif_or_with_a_damaged_file(tmp_path: Path):
    cv2.imwrite(str(tmp_path / "a.png"), _picture(0))
    (tmp_path / "b.jpg").write_bytes(b"nothing")
    source = read_source(tmp_path)
    assert np.isnan(focal_of(tmp_path / "a.png"))
    assert [k for k, _ in source.pictures.greys([0, 1], 32)] == [0]


def test_an_archive_of_photos_in_a_folder(tmp_path: Path):
    inside = tmp_path / "made" / "shots"
    inside.mkdir(parents=True)
    cv2.imwrite(str(inside / "a.png"), _picture(0))
    archive = shutil.make_archive(str(tmp_path / "photos"), "zip", tmp_path / "made")
    assert list(read_source(Path(archive)).pictures.names) == ["a"]


def _transforms(folder: Path, **more: object) -> Path:
    """A transforms.json with its pictures; `more` stands in each of its frames."""
    (folder / "images").mkdir(parents=True)
    frames = []
    for k in range(3):
        cv2.imwrite(str(folder / "images" / f"{k}.png"), _picture(k))
        T = np.eye(4)
        T[0, 3] = 0.1 * k
        frame = {"file_path": f"images/{k}.png", "transform_matrix": T.tolist()}
        frames.append({**frame, "timestamp": float(k), **more})
    camera = {"fl_x": 50, "fl_y": 50, "cx": 32, "cy": 24, "w": 64, "h": 48}
    (folder / "transforms.json").write_text(json.dumps({**camera, "frames": frames}))
    return folder


def test_poses_without_metres_are_left_out_on_demand(tmp_path: Path):
    folder = _transforms(tmp_path / "colmap", colmap_im_id=1)
    with pytest.raises(InputError) as caught:
        read_source(folder)
    assert caught.value.code == "session-no-metres"
    assert "‹no poses›" in caught.value.fix
    assert "‹height›" in caught.value.fix
    source = read_source(folder, poses=False)
    assert source.kind == "photos"
    assert list(source.pictures.names) == ["0", "1", "2"]


def test_xcodes_copy_of_an_app_is_looked_into(tmp_path: Path):
    _transforms(tmp_path / "phone.xcappdata" / "AppData" / "Documents" / "film")
    source = read_source(tmp_path / "phone.xcappdata")
    assert source.kind == "session"
    assert source.T_world_camera is not None


def test_nothing_that_a_scan_can_be_made_of(tmp_path: Path):
    (tmp_path / "readme.txt").write_text("hello")
    with pytest.raises(InputError) as caught:
        read_source(tmp_path)
    assert caught.value.code == "scan-unknown"
    with pytest.raises(InputError) as caught:
        read_source(tmp_path / "absent")
    assert caught.value.code == "scan-missing"


def test_a_session_is_read_as_that_of_the_app_that_is_named(tmp_path: Path):
    film = _transforms(tmp_path / "film")
    found = read_source(film)
    named = read_source(film, app="nerfstudio")
    assert (named.kind, named.pictures.names) == ("session", found.pictures.names)
    for app, code in (("TUM", "session-unknown"), ("no app", "format-unknown")):
        with pytest.raises(InputError) as caught:
            read_source(film, app=app)
        assert caught.value.code == code
