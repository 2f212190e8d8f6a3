"""What is given for a scan: told by its content, read lazily, refused with a way out."""

import shutil
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pycolmap
import pytest
from PIL import Image

from ingest.formats.depth_png import save_millimetres
from ingest.scan.sources.confidence import confidence_of, sure
from ingest.scan.sources.model import model_in, model_source
from ingest.scan.sources.photos import focal_of
from ingest.scan.sources.read import read_source
from ingest.scan.sources.video import Film
from omomo_core.errors import InputError


def _picture(seed: int, size: tuple[int, int] = (64, 48)) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return cv2.resize(rng.integers(0, 255, (6, 8, 3), np.uint8), size)


def _film(path: Path, count: int) -> list[np.ndarray]:
    """A video whose frames are told apart by their brightness; a key frame every 12."""
    pictures = [np.full((48, 64, 3), 5 * k % 250, np.uint8) for k in range(count)]
    for picture in pictures:
        picture[:12, :16] = 255  # the top left corner
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.options = {"crf": "5", "g": "12"}
        for k, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = k, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return pictures


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


def test_some_frames_of_a_video_in_order(tmp_path: Path):
    path = tmp_path / "film.mp4"
    pictures = _film(path, 40)
    source = read_source(path)
    assert source.kind == "video"
    assert len(source.pictures.names) == 40
    assert source.times is not None
    np.testing.assert_allclose(np.diff(source.times), 1 / 30, atol=1e-3)
    wanted = [0, 3, 13, 25, 39]
    found = dict(source.pictures.colours(wanted))
    assert list(found) == wanted
    for k in wanted:
        assert abs(int(found[k][40, 40, 0]) - int(pictures[k][40, 40, 0])) < 8
    greys = dict(source.pictures.greys([39], 32))
    assert greys[39].shape == (24, 32)


def test_a_video_held_upright_is_turned_as_it_says(tmp_path: Path):
    path = tmp_path / "film.mp4"
    _held_upright(tmp_path, path)
    picture = dict(read_source(path).pictures.colours([2]))[2]
    assert picture.shape == (64, 48, 3)
    # Phones state 90 degrees clockwise: the stored top left becomes the top right.
    assert picture[4, -4].mean() > 240
    assert picture[4, 4].mean() < 60


def _held_upright(folder: Path, path: Path) -> None:
    """The same film with the matrix that an upright phone writes into the track header."""
    plain = folder / "plain.mp4"
    _film(plain, 6)
    data = bytearray(plain.read_bytes())
    at = data.index(b"tkhd") + 4 + 40
    matrix = [0, 1, 0, -1, 0, 0, 0, 0, 1]
    one = [1 << 16, 1 << 16, 1 << 30] * 3
    packed = b"".join(
        (m * o).to_bytes(4, "big", signed=True) for m, o in zip(matrix, one, strict=True)
    )
    data[at : at + 36] = packed
    path.write_bytes(bytes(data))


def test_a_video_that_is_none(tmp_path: Path):
    path = tmp_path / "film.mov"
    path.write_bytes(b"no video" * 50)
    with pytest.raises(InputError) as caught:
        read_source(path)
    assert caught.value.code == "video-unreadable"


def test_a_film_without_its_first_frame_keeps_the_numbers_of_the_log(tmp_path: Path):
    path = tmp_path / "film.mp4"
    pictures = _film(path, 10)
    film = Film(path, tuple(str(k) for k in range(11)), 0, 1)
    found = dict(film.colours([0, 1, 10]))
    assert list(found) == [1, 10]
    assert abs(int(found[10][40, 40, 0]) - int(pictures[9][40, 40, 0])) < 8


def test_nothing_that_a_scan_can_be_made_of(tmp_path: Path):
    (tmp_path / "readme.txt").write_text("hello")
    with pytest.raises(InputError) as caught:
        read_source(tmp_path)
    assert caught.value.code == "scan-unknown"
    with pytest.raises(InputError) as caught:
        read_source(tmp_path / "absent")
    assert caught.value.code == "scan-missing"


def test_confidence_beside_depth_in_each_layout(tmp_path: Path):
    levels = np.array([[0, 1, 2], [2, 1, 0]], np.uint8)
    for depth, beside, factor in (
        ("a/depth_00003.png", "a/conf_00003.png", 1),
        ("b/depth/000003.png", "b/confidence/000003.png", 1),
        ("c/depth/17.png", "c/confidence/17.png", 127.5),
    ):
        for name in (depth, beside):
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        save_millimetres(np.ones((2, 3), np.float32), tmp_path / depth)
        cv2.imwrite(str(tmp_path / beside), (levels * factor).astype(np.uint8))
        found = confidence_of(tmp_path / depth)
        assert found is not None
        np.testing.assert_array_equal(found, levels)
        kept = sure(np.ones((2, 3), np.float32), found)
        np.testing.assert_array_equal(kept, levels > 0)
    assert confidence_of(tmp_path / "a" / "other.png") is None


def _model(folder: Path, *, points: int) -> Path:
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="PINHOLE", width=64, height=48, params=[50, 50, 32, 24], camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    for k in (1, 2):
        image = pycolmap.Image(name=f"{k}.png", camera_id=1, image_id=k)
        image.points2D = pycolmap.Point2DList([pycolmap.Point2D([1, 1])] * points)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(np.eye(3)), np.array([k, 0.0, 0.0]))
        model.add_image_with_trivial_frame(image, pose)
    for p in range(points):
        track = pycolmap.Track()
        track.add_element(1, p)
        track.add_element(2, p)
        model.add_point3D(np.array([0.0, 0.0, p]), track)
    folder.mkdir(parents=True)
    model.write(folder)
    return folder


def test_a_colmap_model_with_pictures_beside_it(tmp_path: Path):
    _model(tmp_path / "sparse" / "0", points=2)
    big = _model(tmp_path / "sparse" / "1", points=120)
    (tmp_path / "images").mkdir()
    for k in (1, 2):
        cv2.imwrite(str(tmp_path / "images" / f"{k}.png"), _picture(k))
    assert model_in(tmp_path) == big
    source = read_source(tmp_path)
    assert (source.kind, source.model) == ("colmap", big)
    assert list(source.pictures.names) == ["1.png", "2.png"]


def test_a_colmap_model_without_points_or_pictures(tmp_path: Path):
    with pytest.raises(InputError) as caught:
        model_source(_model(tmp_path / "empty", points=0))
    assert caught.value.code == "model-points"
    with pytest.raises(InputError) as caught:
        model_source(_model(tmp_path / "alone", points=120))
    assert caught.value.code == "model-images"
