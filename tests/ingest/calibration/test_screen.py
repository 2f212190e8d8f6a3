"""The phone's own screen as a board: right within its bounds; a picture of a wrong size is refused."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.calibration.board.board_poses import BoardPoses, board_poses
from ingest.calibration.board.board_spec import Board
from ingest.calibration.phone_body import phone_named
from ingest.calibration.screen.screen import (
    ScreenViews,
    board_size,
    learned_screen,
    mount_from_screen,
    screen_object,
)
from ingest.calibration.screen.shown import (
    load_screen_pose,
    save_screen_pose,
    screen_board,
    screen_of_board,
    screen_picture,
    screen_pose,
    shown_board,
)
from ingest.uncertainty import between, bounds_95, moved, of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.calibration.around_the_phone import cameras

PHONE = phone_named("iPhone 15")
FIXED = Board(5, 7, 0.035, 0.026)
PLACE = np.diag([1e-3**2] * 3 + [5e-4**2] * 3)
K = np.array([[1500.0, 0, 960], [0, 1500, 720], [0, 0, 1]])


def _pose(rng: np.random.Generator, turn: float, shift: float) -> np.ndarray:
    return moved(np.eye(4), rng.normal(size=6) * np.repeat([turn, shift], 3))


def _project(T_camera_board: np.ndarray, board: Board, noise: float, rng) -> np.ndarray:
    turn = Rotation.from_matrix(T_camera_board[:3, :3]).as_rotvec()
    seen = cv2.projectPoints(board.corners, turn, T_camera_board[:3, 3], K, np.zeros(5))[0]
    return np.asarray(seen).reshape(-1, 2) + rng.normal(size=(len(board.corners), 2)) * noise


def _measured(T: np.ndarray, board: Board, believed: Board, noise: float, rng) -> BoardPoses:
    pixels = [_project(pose, board, noise, rng) for pose in T]
    numbers = [np.arange(len(board.corners))] * len(T)
    found = board_poses(pixels, numbers, believed, K, np.zeros(5))
    assert len(found.frames) == len(T)
    assert not found.ambiguous.any()
    return found


def _series(
    rng: np.random.Generator,
    T_screen_object: np.ndarray,
    count: int,
    *,
    shown: Board | None = None,
    believed: Board | None = None,
    turned: int = 0,
    noise: float = 0.4,
) -> list[ScreenViews]:
    """What a camera measures, `count` pictures for each T_screen_object, when `shown` is shown."""
    believed = believed or screen_board(PHONE)
    shown = shown or believed
    T_object_board = np.array([_pose(rng, 0.1, 0.02) for _ in T_screen_object])
    T_screen_fixed = (T_screen_object @ T_object_board).repeat(count, axis=0)
    T_cs = inverse(cameras(rng, count * len(T_screen_object)))
    here = _measured(T_cs @ screen_of_board(shown, turned), shown, believed, noise, rng)
    there = _measured(T_cs @ T_screen_fixed, FIXED, FIXED, noise, rng)
    told = moved(T_object_board, rng.multivariate_normal(np.zeros(6), PLACE, len(T_object_board)))
    return [
        ScreenViews(
            here.T_camera_board[k : k + count],
            here.covariance[k : k + count],
            there.T_camera_board[k : k + count],
            there.covariance[k : k + count],
            inverse(T),
            of_inverse(T, PLACE),
        )
        for k, T in zip(range(0, len(T_cs), count), told, strict=True)
    ]


def _views(
    rng: np.random.Generator, count: int, T_screen_object: np.ndarray, **more: object
) -> ScreenViews:
    return _series(rng, T_screen_object[None], count, **more)[0]  # pyright: ignore[reportArgumentType]


def _placed(rng: np.random.Generator) -> np.ndarray:
    """T_screen_object."""
    T = _pose(rng, 0.1, 0.02)
    T[:3, 3] += [0.05, -0.1, 0.05]
    return T


def _real(rng: np.random.Generator) -> np.ndarray:
    """T_phone_screen of a phone that differs from its drawing."""
    believed = screen_pose(PHONE)
    return moved(believed.T_phone_screen, rng.multivariate_normal(np.zeros(6), believed.covariance))


@pytest.mark.parametrize("count", [1, 8])
def test_the_truth_is_inside_the_bounds(count: int):
    rng = np.random.default_rng(count)
    screen, inside, tries, phones = screen_pose(PHONE), np.zeros(2), 60, 10
    truths = np.array([_placed(rng) for _ in range(tries)])
    for T, views in zip(truths, _series(rng, truths, count), strict=True):
        mount = mount_from_screen(views, screen_board(PHONE), screen, phone=PHONE)
        assert mount.covariance is not None
        bounds = bounds_95(mount.covariance)
        assert bounds.mm < 12
        for _ in range(phones):
            step = between(mount.T_phone_object, _real(rng) @ T)
            inside += [
                1e3 * np.linalg.norm(step[3:]) < bounds.mm,
                np.degrees(np.linalg.norm(step[:3])) < bounds.deg,
            ]
    assert (inside / tries / phones > 0.93).all()
    assert (inside / tries / phones < 0.98).all()


def test_many_pictures_average_their_noise_but_not_the_phones_sizes():
    rng = np.random.default_rng(0)
    believed = screen_pose(PHONE)
    views = _views(rng, 40, _placed(rng))
    placed = screen_object(views, screen_board(PHONE))
    one = screen_object(_first(views, 1), screen_board(PHONE))
    assert placed.covariance[0, 0] < one.covariance[0, 0] / 4
    mount = mount_from_screen(views, screen_board(PHONE), believed)
    assert mount.covariance is not None
    assert bounds_95(mount.covariance).deg >= bounds_95(believed.covariance).deg * 0.99


def _first(views: ScreenViews, count: int) -> ScreenViews:
    return ScreenViews(
        *(getattr(views, n)[:count] for n in list(views.__dataclass_fields__)[:4]),
        views.T_reference_object,
        views.of_object,
    )


@pytest.mark.parametrize("turned", [0, 90, 180, 270])
def test_a_turned_picture_gives_the_same_mount_when_it_is_told(turned: int):
    rng = np.random.default_rng(3)
    screen = screen_pose(PHONE)
    T_screen_object = _placed(rng)
    real = shown_board(PHONE, turned)
    assert real.square == pytest.approx(
        screen_board(PHONE).square * (1 if turned % 180 == 0 else 1179 / 2556)
    )
    views = _views(rng, 10, T_screen_object, believed=real, turned=turned, noise=0.05)
    views = replace(views, of_object=np.zeros((6, 6)))
    mount = mount_from_screen(views, real, screen, turned=turned, phone=PHONE)
    off = between(mount.T_phone_object, screen.T_phone_screen @ T_screen_object)
    assert np.abs(off[:3]).max() < 0.01
    assert np.abs(off[3:]).max() < 0.003


def test_a_shrunk_picture_is_refused_with_its_size():
    rng = np.random.default_rng(4)
    T_screen_object = _placed(rng)
    board = screen_board(PHONE)
    zoomed = replace(board, square=1.15 * board.square, marker=1.15 * board.marker)
    views = _views(rng, 8, T_screen_object, shown=zoomed)
    with pytest.raises(InputError) as caught:
        mount_from_screen(views, board, screen_pose(PHONE), phone=PHONE)
    assert caught.value.code == "screen-size"
    assert "1.1" in caught.value.what
    lying = _views(rng, 8, T_screen_object, shown=shown_board(PHONE, 90), turned=90)
    with pytest.raises(InputError) as caught:
        mount_from_screen(lying, board, screen_pose(PHONE), phone=PHONE)
    assert caught.value.code == "screen-size"
    assert "--turned" in caught.value.fix


def test_the_size_is_sure_as_it_says_and_unknown_from_one_side():
    rng = np.random.default_rng(5)
    sizes = [board_size(v) for v in _series(rng, np.array([_placed(rng)] * 60), 6)]
    off = [(size.ratio - 1) / size.sigma for size in sizes if size]
    assert len(off) == 60
    assert np.mean(np.abs(off) < 2.1) > 0.88
    alone = _views(rng, 1, _placed(rng))
    assert board_size(alone) is None
    mount = mount_from_screen(alone, screen_board(PHONE), screen_pose(PHONE))
    assert "size of the picture on the screen was not checked" in mount.note


def test_a_model_without_scale_takes_it_from_the_screen():
    rng = np.random.default_rng(6)
    screen, T_screen_object = screen_pose(PHONE), _placed(rng)
    views = _views(rng, 12, T_screen_object, noise=0.1)
    T, T_ro = views.T_camera_reference.copy(), views.T_reference_object.copy()
    T[:, :3, 3] *= 4
    T_ro[:3, 3] *= 4
    unscaled = replace(views, T_camera_reference=T, T_reference_object=T_ro)
    mount = mount_from_screen(unscaled, screen_board(PHONE), screen, scaled=True)
    assert mount.object_scale == pytest.approx(0.25, rel=0.01)
    metric = mount_from_screen(views, screen_board(PHONE), screen)
    assert np.abs(between(mount.T_phone_object, metric.T_phone_object)).max() < 0.006
    with pytest.raises(InputError) as caught:
        mount_from_screen(_first(views, 1), screen_board(PHONE), screen, scaled=True)
    assert caught.value.code == "screen-scale"


def test_no_pictures_and_a_turn_that_is_none():
    rng = np.random.default_rng(7)
    views = _views(rng, 2, _placed(rng))
    screen, board = screen_pose(PHONE), screen_board(PHONE)
    for code, arguments in [
        ("screen-few", {"views": _first(views, 0)}),
        ("screen-turned", {"views": views, "turned": 45}),
    ]:
        with pytest.raises(InputError) as caught:
            mount_from_screen(board=board, screen=screen, **arguments)
        assert caught.value.code == code


def test_what_is_learned_of_a_phone_is_written_read_and_used(tmp_path: Path):
    rng = np.random.default_rng(8)
    believed, real, T_screen_object = screen_pose(PHONE), _real(rng), _placed(rng)
    views = _views(rng, 12, T_screen_object)
    placed = screen_object(views, screen_board(PHONE))
    known = mount_from_screen(views, screen_board(PHONE), believed)
    good = replace(
        known, T_phone_object=real @ T_screen_object, covariance=1e-6 * np.eye(6), method="board"
    )
    learned = learned_screen(placed, good)
    path = tmp_path / "phone.json"
    save_screen_pose(learned, PHONE.name, path)
    back = load_screen_pose(path)
    np.testing.assert_allclose(back.T_phone_screen, learned.T_phone_screen)
    assert np.abs(between(back.T_phone_screen, real)[3:]).max() < 0.003
    again = mount_from_screen(views, screen_board(PHONE), back)
    assert np.abs(between(again.T_phone_object, real @ T_screen_object)).max() < 1e-6
    with pytest.raises(InputError) as caught:
        learned_screen(placed, replace(good, covariance=None))
    assert caught.value.code == "mount-covariance"


@pytest.mark.parametrize("text", ["", "{}", '{"T_phone_screen": [[1]], "covariance": []}'])
def test_a_damaged_phone_file(tmp_path: Path, text: str):
    path = tmp_path / "phone.json"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_screen_pose(path)
    assert caught.value.code == "phone-file"


@pytest.mark.parametrize("name", ["iPhone 15", "iPhone SE (3rd generation)", "iPhone 12 mini"])
def test_the_picture_shows_the_board_where_it_is_said_to_be(name: str):
    phone = phone_named(name)
    image = screen_picture(phone)
    assert phone.screen is not None
    assert image.shape == (phone.pixels or (0, 0))[::-1]
    board = screen_board(phone)
    found = cv2.aruco.CharucoDetector(board.charuco).detectBoard(image)
    pixels = np.asarray(found[0]).reshape(-1, 2)
    numbers = np.asarray(found[1]).ravel()
    assert len(numbers) == len(board.corners)
    scale = image.shape[1] / phone.screen[0]
    on_screen = screen_of_board(board, 0) @ np.c_[board.corners, np.ones(len(board.corners))].T
    expected = scale * on_screen[:2].T[numbers] + np.array(image.shape[::-1]) / 2 - 0.5
    np.testing.assert_allclose(pixels, expected, atol=0.6)


def test_unknown_screens_are_refused():
    other = phone_named("Pixel 9", (72.0, 152.8, 30.0, 40.0))
    for make in (screen_board, screen_picture, screen_pose):
        with pytest.raises(InputError) as caught:
            make(other)
        assert caught.value.code == "screen-unknown"
