"""Cameras by the pictures alone, scaled by a board, a length, a height, or a model's own word."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.calibration.board.board_spec import PRESETS
from ingest.scan.cameras.features import CameraOptions, Length, Sight
from ingest.scan.cameras.metric_scale import by_length, crossing
from ingest.scan.cameras.pose_agreement import in_one_motion
from ingest.scan.cameras.register import register
from ingest.scan.scan_pictures import pick_frames
from ingest.scan.scan_sources import read_source
from ingest.scan.scan_types import Registered, View
from ingest.uncertainty import rotation
from omomo_core.errors import InputError
from render.cameras import look_at
from tests.ingest.scan.filmed import STEADY, off, with_board
from tests.simulator.scan_film import ScanFilm, around, film_photos
from tests.simulator.scan_scene import scan_scene

BOARD = PRESETS["A3"]


def _view(name: str, eye: list[float]) -> View:
    T = look_at(np.array(eye, float), np.zeros(3)) @ np.diag([1.0, -1.0, -1.0, 1.0])
    K = np.array([500.0, 500.0, 319.5, 239.5])
    return View(name, Path(name), (640, 480), K, T)


def _pixel(view: View, point: np.ndarray) -> np.ndarray:
    seen = view.T_world_camera[:3, :3].T @ (point - view.T_world_camera[:3, 3])
    return seen[:2] / seen[2] * view.intrinsics[:2] + view.intrinsics[2:]


def _sights(views: list[View], point: list[float]) -> tuple[Sight, ...]:
    pixels = [_pixel(view, np.array(point)) for view in views]
    return tuple(Sight(v.name, *p.tolist()) for v, p in zip(views, pixels, strict=True))


def test_a_picked_length_scales_the_model():
    views = [_view("a.jpg", [2, 0, 1]), _view("b.jpg", [0, 2, 1]), _view("c.jpg", [-1, 1, 1])]
    a, b = _sights(views[:2], [0.1, 0, 0]), _sights(views, [0.1, 0, 0.4])
    factor, scale = by_length(views, Length(0.8, a, b))
    assert factor == pytest.approx(2.0)
    assert scale.by == "length"
    assert 0.001 < scale.sigma < 0.05
    stems = tuple(replace(sight, picture=Path(sight.picture).stem) for sight in b)
    assert by_length(views, Length(0.8, a, stems))[0] == pytest.approx(2.0)


def test_points_of_a_length_that_cannot_be_placed():
    views = [_view("a.jpg", [2, 0, 1]), _view("near.jpg", [2, 0.01, 1])]
    a, b = _sights(views, [0.1, 0, 0]), _sights(views, [0.1, 0, 0.4])
    for length, code in (
        (Length(0.8, a, b), "scan-length"),
        (Length(0.8, a[:1], b), "scan-length"),
        (Length(0.8, (replace(a[0], picture="no.jpg"),), b), "scan-length-picture"),
    ):
        with pytest.raises(InputError) as caught:
            by_length(views, length)
        assert caught.value.code == code
    behind = [(v, np.array([p.x, p.y])) for v, p in zip(views, a, strict=True)]
    assert crossing(behind[:1]) is None


def test_pictures_without_a_scale_are_refused_before_the_work(tmp_path: Path):
    _grey_photos(tmp_path / "in")
    source = read_source(tmp_path / "in")
    frames = pick_frames(source, tmp_path / "work")
    with pytest.raises(InputError) as caught:
        register(source, frames, tmp_path / "work")
    assert caught.value.code == "scan-scale"
    with pytest.raises(InputError) as caught:
        register(source, frames, tmp_path / "work", options=CameraOptions(height=84.0))
    assert caught.value.code == "scan-length"
    assert not (tmp_path / "work" / "database.db").exists()


def test_pictures_of_nothing(tmp_path: Path):
    _grey_photos(tmp_path / "in")
    source = read_source(tmp_path / "in")
    frames = pick_frames(source, tmp_path / "work")
    with pytest.raises(InputError) as caught:
        register(source, frames, tmp_path / "work", options=CameraOptions(height=0.84))
    assert caught.value.code == "scan-textureless"


def _grey_photos(folder: Path) -> None:
    """Sharp pictures of a wall with one edge."""
    folder.mkdir()
    for k in range(14):
        picture = np.full((120, 160, 3), 130, np.uint8)
        picture[:, 40 + 4 * k :] = 90
        cv2.imwrite(str(folder / f"{k:02d}.png"), picture)


@dataclass(frozen=True)
class Photographed:
    film: ScanFilm
    work: Path
    found: Registered


@pytest.fixture(scope="module")
def photographed(tmp_path_factory: pytest.TempPathFactory) -> Photographed:
    folder = tmp_path_factory.mktemp("photos")
    scene = with_board(scan_scene(21, "box"), BOARD)
    T = around(scene, 36, seed=3)
    film = film_photos(scene, folder / "in", T, width=800, seed=3, errors=STEADY)
    source = read_source(film.path)
    frames = pick_frames(source, folder / "work")
    options = CameraOptions(board=BOARD)
    return Photographed(
        film, folder / "work", register(source, frames, folder / "work", options=options)
    )


def _once_more(photographed: Photographed, folder: Path, options: CameraOptions) -> Registered:
    """The same pictures with another scale; features and matches are there already."""
    shutil.copytree(photographed.work, folder)
    source = read_source(photographed.film.path)
    return register(source, pick_frames(source, folder), folder, options=options)


@pytest.mark.slow
def test_photos_with_a_board_come_out_in_metres_and_upright(photographed: Photographed):
    found = photographed.found
    assert found.left_out == ()
    assert len(found.views) >= 30
    scale, shape = off(photographed.film, found)
    assert abs(scale) < 0.005
    assert abs(scale) < 3 * found.scale.sigma < 0.02
    assert shape < 0.003
    assert (found.scale.by, found.up) == ("board", "board")
    floor = found.points[np.abs(found.points[:, 2]) < 0.02]
    assert len(floor) > 0.1 * len(found.points)
    focal = found.views[0].intrinsics[0]
    assert focal == pytest.approx(1460 / 1920 * 800, rel=0.01)


@pytest.mark.slow
def test_photos_with_the_height_of_the_object_wait_for_it(
    photographed: Photographed, tmp_path: Path
):
    found = _once_more(photographed, tmp_path / "work", CameraOptions(height=0.41))
    assert (found.scale.by, found.up) == ("height", "floor")
    tilt = _up_error(photographed, found)
    assert tilt < 1.0


@pytest.mark.slow
def test_a_board_that_is_not_there(photographed: Photographed, tmp_path: Path):
    with pytest.raises(InputError) as caught:
        _once_more(
            photographed,
            tmp_path / "work",
            CameraOptions(board=replace(BOARD, dictionary="DICT_4X4_50")),
        )
    assert caught.value.code == "scan-board-missing"


def _up_error(photographed: Photographed, found: Registered) -> float:
    places = [int(view.name[:5]) for view in found.views]
    real = photographed.film.T_world_phone[places] @ np.diag([1.0, -1.0, -1.0, 1.0])
    T = np.array([view.T_world_camera for view in found.views])
    # The world's z as the camera sees it, seen again in the world that was found.
    up = np.einsum("nij,nj->ni", T[:, :3, :3], real[:, 2, :3])
    return float(np.degrees(np.arccos(np.clip(up[:, 2], -1, 1))).mean())


@pytest.mark.slow
def test_a_finished_model_is_taken_as_it_is(photographed: Photographed, tmp_path: Path):
    model = photographed.found.model
    source = read_source(model)
    frames = pick_frames(source, tmp_path / "work")
    found = register(source, frames, tmp_path / "work", options=CameraOptions(metric=True))
    assert (found.scale.by, found.up) == ("given", "given")
    assert len(found.views) == len(photographed.found.views)
    np.testing.assert_allclose(found.points, photographed.found.points, atol=1e-9)
    assert all(view.file.is_file() for view in found.views)
    scaled = register(source, frames, tmp_path / "work", options=CameraOptions(board=BOARD))
    assert abs(off(photographed.film, scaled)[0]) < 0.005


def test_matches_of_no_motion_at_all_end_no_scan(monkeypatch: pytest.MonkeyPatch):
    def fails(*_: object) -> None:
        raise cv2.error("Assertion failed: !model.empty()")

    a = np.random.default_rng(0).random((30, 2)) * 300
    assert in_one_motion(a, a + np.array([20.0, 5.0])) == 30
    monkeypatch.setattr(cv2, "findFundamentalMat", fails)
    assert in_one_motion(a, a) == 0


@pytest.mark.slow
def test_an_object_that_was_moved_while_it_was_filmed(tmp_path: Path):
    scene = scan_scene(21, "box")
    T = around(scene, 36, seed=3)
    moved = scene.T_world_object.copy()
    moved[:3, :3] = rotation(np.array([0.0, 0.0, 0.3])) @ moved[:3, :3]
    moved[:3, 3] += [0.08, 0.05, 0.0]
    film_photos(scene, tmp_path / "in", T, width=640, seed=3, errors=STEADY)
    film_photos(
        replace(scene, T_world_object=moved),
        tmp_path / "later",
        T,
        width=640,
        seed=3,
        errors=STEADY,
    )
    for k in range(18, 36):
        shutil.copy(tmp_path / "later" / f"{k:05d}.jpg", tmp_path / "in" / f"{k:05d}.jpg")
    source = read_source(tmp_path / "in")
    frames = pick_frames(source, tmp_path / "work")
    found = register(source, frames, tmp_path / "work", options=CameraOptions(height=0.41))
    assert "stillness" in [note.name for note in found.notes]


@pytest.mark.slow
def test_pictures_that_do_not_overlap(tmp_path: Path):
    for k in range(7):
        scene = scan_scene(100 + k, "box")
        T = around(scene, 40, seed=3)[[0, 1]]
        film_photos(scene, tmp_path / f"room {k}", T, width=480, seed=k, errors=STEADY)
        for file in (tmp_path / f"room {k}").iterdir():
            (tmp_path / "in").mkdir(exist_ok=True)
            shutil.copy(file, tmp_path / "in" / f"{k}_{file.name}")
    source = read_source(tmp_path / "in")
    frames = pick_frames(source, tmp_path / "work")
    with pytest.raises(InputError) as caught:
        register(source, frames, tmp_path / "work", options=CameraOptions(height=0.41))
    assert caught.value.code == "scan-overlap"
