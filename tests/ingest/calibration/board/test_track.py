"""A board in videos, folders and sessions; and what is said when it is not the right one."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.calibration.board.board_detect import Detector
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import PRESETS, Board, Checkerboard
from ingest.calibration.board.board_track import track_session, track_video, with_camera
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.session import CaptureSession
from ingest.uncertainty import between
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.calibration.board.filmed import CAMERA, SIZE, picture, sway, write_film

BOARD = PRESETS["A4"]
TRUTH = sway(48)
STAMPS = [40 * k for k in range(48)]


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    return [picture(T, BOARD) for T in TRUTH]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory, pictures) -> Path:
    return write_film(tmp_path_factory.mktemp("film") / "board.mp4", pictures, STAMPS)


def errors(track, T: np.ndarray) -> tuple[float, float]:
    """Largest error of position (mm) and rotation (deg)."""
    step = between(track.T_camera_board, T)
    return (
        1e3 * float(np.linalg.norm(step[:, 3:], axis=1).max()),
        float(np.degrees(np.linalg.norm(step[:, :3], axis=1).max())),
    )


def test_a_video_gives_the_boards_poses(film: Path):
    heard: list[float] = []
    track = track_video(film, BOARD, CAMERA, rate=30.0, progress=lambda name, x: heard.append(x))
    assert len(track.times) > 40
    index = np.rint(track.times / 0.040).astype(int)
    mm, deg = errors(track, TRUTH[index])
    assert mm < 1.5
    assert deg < 0.5
    assert track.sigma < 0.2
    assert heard == sorted(heard)
    assert heard[-1] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("blur", [0.0, 1.5])
def test_corners_are_where_they_are_without_bias(pictures, blur):
    off = []
    for T, grey in zip(TRUTH[::4], pictures[::4], strict=True):
        found = Detector(BOARD).find(cv2.GaussianBlur(grey, (0, 0), blur) if blur else grey)
        points = BOARD.corners[found.numbers] @ T[:3, :3].T + T[:3, 3]
        off.append(found.pixels - (820 * points[:, :2] / points[:, 2:] + [395, 305]))
    off = np.concatenate(off)
    assert len(off) > 100
    assert np.abs(off.mean(axis=0)).max() < 0.02
    assert off.std(axis=0).max() < 0.1


def test_only_so_many_pictures_are_looked_at(film: Path):
    track = track_video(film, BOARD, CAMERA, rate=10.0)
    # A picture every 40 ms: each 100 ms the next one.
    assert track.pictures == pytest.approx(1.92 * 10, abs=1)
    assert np.diff(track.times).min() > 0.07


def test_times_are_those_of_the_file(tmp_path: Path, pictures):
    stamps = np.cumsum([33, 50, 33, 67, 100, 33] * 8).tolist()
    track = track_video(write_film(tmp_path / "v.mp4", pictures, stamps), BOARD, CAMERA, rate=100.0)
    at = np.searchsorted(stamps, 1e3 * track.times - 1)
    np.testing.assert_allclose(1e3 * track.times, np.array(stamps)[at], atol=0.5)
    assert errors(track, TRUTH[at])[0] < 1.5


def test_a_folder_with_times(tmp_path: Path, pictures):
    lines = ["file,seconds"]
    for k, grey in enumerate(pictures[:20]):
        cv2.imwrite(str(tmp_path / f"{k:03}.png"), grey)
        lines.append(f"{k:03}.png,{100 + 0.1 * k}")
    (tmp_path / "times.csv").write_text("\n".join(lines))
    track = track_video(tmp_path, BOARD, CAMERA)
    index = np.rint((track.times - 100) / 0.1).astype(int)
    assert errors(track, TRUTH[index])[0] < 1.0
    (tmp_path / "times.csv").unlink()
    with pytest.raises(InputError) as error:
        track_video(tmp_path, BOARD, CAMERA)
    assert error.value.code == "times-missing"


def test_a_phone_as_witness_brings_its_camera_and_where_it_was(tmp_path: Path, pictures):
    files = []
    for k, grey in enumerate(pictures[:24]):
        # The phone was upright: its pictures are stored turned, its intrinsics are of the landscape.
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.rot90(grey, -1))
        files.append(tmp_path / f"{k}.png")
    times = 5000 + np.array(STAMPS[:24]) / 1e3
    # Walked along x in its world while it filmed.
    T_world_phone = np.tile(np.eye(4), (24, 1, 1))
    T_world_phone[:, 0, 3] = 0.01 * np.arange(24)
    session = CaptureSession(
        app="test",
        source=tmp_path,
        times=times,
        T_world_phone=T_world_phone,
        intrinsics=np.tile([2 * 820.0, 2 * 820.0, 2 * 395.5 - 0.5, 2 * 305.5 - 0.5], (24, 1)),
        image_size=(2 * SIZE[0], 2 * SIZE[1]),
        images=tuple(files),
        video_times=times,
        image_turns=1,
    )
    track = track_session(session, BOARD, rate=100.0)
    index = np.searchsorted(times, track.times - 1e-3)
    assert errors(track, TRUTH[index])[0] < 1.0
    assert track.T_world_camera is not None
    phone = track.T_world_camera @ inverse(T_OPENCV_ARKIT_CAMERA)
    np.testing.assert_allclose(phone, T_world_phone[index], atol=1e-9)


def test_a_phones_video_has_the_times_of_its_log(film: Path):
    times = 5000 + np.array(STAMPS) / 1e3 * 1.5  # the stamps inside the video are not real time
    session = CaptureSession(
        app="test",
        source=film,
        times=times,
        T_world_phone=np.tile(np.eye(4), (48, 1, 1)),
        intrinsics=np.tile([820.0, 820.0, 395.0, 305.0], (48, 1)),
        image_size=SIZE,
        video=film,
        video_times=times,
    )
    track = track_session(session, BOARD, rate=12.0)
    index = np.searchsorted(times, track.times - 1e-3)
    np.testing.assert_allclose(track.times, times[index], atol=1e-6)
    assert errors(track, TRUTH[index])[0] < 1.5
    assert np.diff(track.times).min() > 0.05
    with pytest.raises(InputError) as error:
        track_session(replace(session, intrinsics=None), BOARD)
    assert error.value.code == "no-intrinsics"
    with pytest.raises(InputError) as error:
        track_session(replace(session, video=None), BOARD)
    assert error.value.code == "no-video"


def test_a_video_is_bounded(film: Path, monkeypatch):
    monkeypatch.setattr("ingest.calibration.board.board_track.MAX_PICTURES", 5)
    with pytest.raises(InputError) as error:
        track_video(film, BOARD, CAMERA)
    assert error.value.code == "video-bounds"


def test_the_camera_is_calibrated_where_none_is_given(film: Path):
    track = track_video(film, BOARD, rate=30.0)
    assert track.camera.sigmas is not None
    assert abs(track.camera.fx - CAMERA.fx) < 4 * track.camera.sigmas[0] + 4
    # The same corners with the true camera give the true poses.
    right = with_camera(track, CAMERA)
    assert errors(right, TRUTH[np.rint(right.times / 0.040).astype(int)])[0] < 1.5


@pytest.mark.parametrize(
    ("asked", "code", "says"),
    [
        (replace(BOARD, dictionary="DICT_6X6_250"), "board-dictionary-other", "DICT_5X5"),
        (Board(7, 5, 0.035, 0.026), "board-layout", "5x7"),
        (Board(6, 9, 0.035, 0.026), "board-layout", "columns"),
    ],
)
def test_another_board_than_asked_for_is_told(film: Path, asked, code, says):
    with pytest.raises(InputError) as error:
        track_video(film, asked, CAMERA, rate=10.0)
    assert error.value.code == code
    assert says in error.value.what + error.value.fix


def test_a_legacy_board_is_told(tmp_path: Path):
    board = Board(5, 6, 0.035, 0.026)
    shown = [picture(T, replace(board, legacy=True)) for T in TRUTH[::3]]
    path = write_film(tmp_path / "v.mp4", shown, [100 * k for k in range(len(shown))])
    with pytest.raises(InputError) as error:
        track_video(path, board, CAMERA)
    assert error.value.code == "board-layout"
    assert ":legacy" in error.value.fix


def test_a_mirrored_video_is_told(tmp_path: Path, pictures):
    mirrored = [np.ascontiguousarray(p[:, ::-1]) for p in pictures[::3]]
    path = write_film(tmp_path / "v.mp4", mirrored, [100 * k for k in range(len(mirrored))])
    with pytest.raises(InputError) as error:
        track_video(path, BOARD, CAMERA)
    assert error.value.code == "board-mirrored"


def test_too_few_and_none_are_told_apart(tmp_path: Path, pictures):
    empty = [np.full_like(pictures[0], 120)] * 30
    path = write_film(tmp_path / "none.mp4", empty, [70 * k for k in range(30)])
    with pytest.raises(InputError) as error:
        track_video(path, BOARD, CAMERA)
    assert error.value.code == "board-not-seen"
    few = pictures[:4] + pictures[:4] + empty[:20]
    path = write_film(tmp_path / "few.mp4", few, [70 * k for k in range(28)])
    with pytest.raises(InputError) as error:
        track_video(path, BOARD, CAMERA)
    assert error.value.code == "board-few"
    assert "8 of 28" in error.value.what


def test_a_wrong_camera_shows_in_the_reprojection(film: Path):
    wrong = replace(CAMERA, fx=300.0, fy=1500.0)
    with pytest.raises(InputError) as error:
        track_video(film, BOARD, wrong, rate=10.0)
    assert error.value.code in ("board-reprojection", "board-few")


def test_what_is_no_video_is_refused(tmp_path: Path):
    (tmp_path / "v.mp4").write_text("no video")
    with pytest.raises(InputError) as error:
        track_video(tmp_path / "v.mp4", BOARD, CAMERA)
    assert error.value.code == "no-video"


def test_a_real_photo_gives_its_known_pose(shared: Path):
    """The photo of MoveIt's tests; its frame is OpenCV's old one, at the lower left corner."""
    file = shared / "data" / "capture" / "moveit_handeye" / "test_charuco_board_detection.jpg"
    board = Board(5, 7, 0.1971 / 7, 0.0176, "DICT_5X5_250")
    found = Detector(board).find(np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)))
    K = np.array([[590.697, 0, 322.331], [0, 592.847, 247.400], [0, 0, 1]])
    lens = np.array([0.15405, -0.24917, 0.00351, -0.00110, 0])
    pose = board_poses([found.pixels], [found.numbers], board, K, lens)
    assert pose.corners[0] >= 21
    assert pose.rms[0] < 0.35
    assert not pose.ambiguous[0]
    corner = pose.T_camera_board[0] @ [0, board.height, 0, 1]
    np.testing.assert_allclose(corner[:3], [0.0975, 0.1028, 0.3256], atol=0.002)


PLAIN = Checkerboard(8, 7, 0.025)


def test_a_plain_checkerboard_that_cannot_be_turned_is_followed(tmp_path: Path):
    truth = sway(20)
    film = write_film(tmp_path / "plain.mp4", [picture(T, PLAIN) for T in truth], STAMPS[:20])
    track = track_video(film, PLAIN, CAMERA, rate=30.0)
    assert len(track.times) > 15
    mm, deg = errors(track, truth[np.rint(track.times / 0.040).astype(int)])
    assert mm < 1.5
    assert deg < 0.5


def test_a_checkerboard_that_is_not_there(film: Path):
    with pytest.raises(InputError) as error:
        track_video(film, PLAIN, CAMERA)
    assert error.value.code == "board-not-seen"
    assert "inner corners" in (error.value.fix or "")
