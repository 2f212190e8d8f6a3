"""What the guide finds in a recording, in a film, and in a mount, before anything is computed."""

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from capture_app.calibration.guide_recordings import (
    filmed_board,
    filmed_by_phone,
    filmed_rest,
    pictured_recording,
    rested_recording,
    turned_recording,
)
from capture_app.calibration.guide_steps import as_path, off_surface, where_it_sits
from capture_app.simulator.demo_take import box_mesh, clamped_phone
from capture_app.simulator.simulated_phone import simulate
from ingest.calibration.board.board_spec import PRESETS, Board
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from tests.ingest.calibration.board.filmed import picture, sway, write_film
from tests.simulator.scan_log import scan_log
from tests.simulator.scan_scene import scan_scene
from tests.simulator.wiggle import Wiggle, wiggle_motion

BOARD = PRESETS["A4"]


def moving(kind: Wiggle):
    return simulate(wiggle_motion(kind, seconds=20.0, seed=2), clamped_phone(), seed=2)


def test_turns_of_a_recording():
    good = turned_recording(moving("all axes"))
    assert not good.doubts
    assert "tracked without a break" in good.good
    assert len(turned_recording(moving("yaw")).doubts) == 1
    for kind in ("tiny", "translation"):
        with pytest.raises(InputError, match="The phone turned by"):
            turned_recording(moving(kind))


def test_breaks_of_a_recording():
    session = moving("all axes")
    times = session.times + 3.0 * (session.times > session.times[0] + 7.0)
    found = turned_recording(replace(session, times=times))
    assert "tracked without a break for 13 s" in found.good
    assert "Only 13 s without a break can be used" in found.doubts[0]
    slow = replace(
        session, times=session.times[::12], T_world_phone=session.T_world_phone[::12],
        intrinsics=None, video_times=None,
    )  # fmt: skip
    with pytest.raises(InputError, match="5 poses a second"):
        rested_recording(slow)


def filmed(folder: Path, board: Board, shown: Sequence[bool]) -> Path:
    """A film at two pictures a second in which the board is shown at times."""
    blank = np.full((600, 800), 120, np.uint8)
    poses = sway(len(shown))
    pictures = [picture(T, board) if show else blank for T, show in zip(poses, shown, strict=True)]
    return write_film(folder / "film.mp4", pictures, [500 * k for k in range(len(shown))])


def test_a_film_that_shows_the_board(tmp_path: Path):
    found = filmed_board(filmed(tmp_path, BOARD, [True] * 8), BOARD)
    assert not found.doubts
    assert "of 8 pictures at its beginning 8 show the board, with 100% of its corners" in found.good


def test_a_film_that_misses_the_board_most_of_the_time(tmp_path: Path):
    found = filmed_board(filmed(tmp_path, BOARD, [True] * 4 + [False] * 8), BOARD)
    assert "The others miss the board" in found.doubts[0]


def test_a_film_of_another_board(tmp_path: Path):
    with pytest.raises(InputError) as caught:
        filmed_board(filmed(tmp_path, Board(7, 5, 0.035, 0.026), [True] * 5), BOARD)
    assert caught.value.code == "board-layout"


@pytest.fixture(scope="module")
def log() -> CaptureSession:
    """A phone that is carried around a chair for 12 s, clamped, and rests twice."""
    return scan_log(scan_scene(4), seed=4)[0]


def with_images(
    log: CaptureSession, folder: Path, images: dict[float, np.ndarray]
) -> CaptureSession:
    """The log with these pictures at these seconds from its start."""
    files = tuple(folder / f"{seconds:05.1f}.png" for seconds in images)
    for file, image in zip(files, images.values(), strict=True):
        cv2.imwrite(str(file), image)
    nearest = [int(np.abs(log.times - log.times[0] - seconds).argmin()) for seconds in images]
    return replace(log, images=files, video_times=log.times[nearest])


def test_a_rest_with_and_without_pictures(log: CaptureSession, tmp_path: Path):
    assert "rests from 14.9 to 17.6 s and again" in rested_recording(log).good
    blank = np.zeros((480, 640), np.uint8)
    found = filmed_rest(with_images(log, tmp_path, {16.0: blank, 22.5: blank}))
    assert "2 pictures of 640 x 480 there" in found.good
    for session, code in (
        (log, "scan-no-pictures"),
        (with_images(log, tmp_path, {3.0: blank}), "scan-no-pictures"),
        (replace(log, intrinsics=None), "scan-no-camera"),
    ):
        with pytest.raises(InputError) as caught:
            filmed_rest(session)
        assert caught.value.code == code


def test_a_board_that_the_phone_filmed_before_it_was_clamped(log: CaptureSession, tmp_path: Path):
    blank = np.full((600, 800), 120, np.uint8)
    shown = {float(k): picture(T, BOARD) for k, T in enumerate(sway(5))}
    later = {float(k): blank for k in range(5, 24)}
    session = with_images(log, tmp_path, shown | later)
    assert "the clamped phone rests" in pictured_recording(session).good
    found = filmed_by_phone(session, BOARD, before=15.0)
    assert "of 15 pictures at its beginning 5 show the board" in found.good
    assert not found.doubts
    for wrong, code in (
        (replace(session, intrinsics=None), "no-intrinsics"),
        (log, "no-video"),
    ):
        with pytest.raises(InputError) as caught:
            pictured_recording(wrong)
        assert caught.value.code == code


def test_where_a_phone_sits_in_words():
    told = where_it_sits(clamped_phone(), box_mesh())
    assert "on the object's +x side, 3 cm from its surface" in told
    assert "the screen faces -x, the top edge points +z" in told
    slanted = np.array([[0.0, 0, 0], [0, 0, 0.25]])
    np.testing.assert_allclose(off_surface(box_mesh(), slanted), [0.15, 0.1], atol=1e-9)


def test_paths_as_they_are_dropped_on_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    there = tmp_path / "my take's"
    there.mkdir()
    for text in (str(there), shlex.quote(str(there)), f'"{there}"', "~/my take's"):
        assert as_path(text) == there
    assert as_path(str(there).replace(" ", "\\ ").replace("'", "\\'")) == there
    assert as_path("'not closed") == Path("'not closed")
