"""Boards: the text that names them, what is refused, and where their frame is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.calibration.board.board_detect import Detector
from ingest.calibration.board.board_place import parse_grid
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import (
    PRESETS,
    Board,
    Checkerboard,
    board_image,
    parse_board,
)
from omomo_core.errors import InputError

SMALL = Board(5, 4, 0.03, 0.022)


@settings(max_examples=30)
@given(
    columns=st.integers(3, 9),
    rows=st.integers(4, 9),
    square=st.integers(50, 900),
    share=st.floats(0.3, 0.95),
    legacy=st.booleans(),
)
def test_the_text_names_the_board(columns, rows, square, share, legacy):
    side = square / 1e4
    board = Board(columns, rows, side, round(share * side, 5), "DICT_6X6_250", legacy)
    again = parse_board(str(board))
    assert str(again) == str(board)
    assert (again.columns, again.rows, again.legacy) == (columns, rows, legacy)
    assert again.square == pytest.approx(board.square, abs=1e-9)


@pytest.mark.parametrize(
    "text",
    ["5x7:30mm:22mm:DICT_5X5_250", "5x7:3cm:2.2cm:dict_5x5_250", "5X7:0.03m:0.022m:Dict_5x5_250"],
)
def test_units_and_case_do_not_matter(text):
    assert parse_board(text) == Board(5, 7, 0.03, 0.022, "DICT_5X5_250")


def test_papers_are_presets():
    assert parse_board("letter") == PRESETS["Letter"]


@pytest.mark.parametrize(
    ("text", "code", "hint"),
    [
        ("5x7", "board-text", "5x7:35mm"),
        ("5x7:30:22:DICT_5X5_250", "board-text", "columns x rows"),
        ("5x7:30mm:22mm:DICT_9X9", "board-dictionary", "DICT_5X5_100"),
        ("5x7:22mm:30mm:DICT_5X5_250", "board-size", "square comes first"),
        ("5x7:30m:22m:DICT_5X5_250", "board-size", "unit"),
        ("2x2:30mm:22mm:DICT_5X5_250", "board-size", "3 x 4"),
        ("12x12:30mm:22mm:DICT_5X5_50", "board-dictionary", "larger dictionary"),
    ],
)
def test_what_is_no_board_is_refused_with_advice(text, code, hint):
    with pytest.raises(InputError) as error:
        parse_board(text)
    assert error.value.code == code
    assert hint in error.value.fix


@pytest.mark.parametrize(
    "board", [SMALL, Board(4, 6, 0.03, 0.022), Board(4, 6, 0.03, 0.022, legacy=True)]
)
def test_corners_are_where_the_picture_shows_them(board):
    found = Detector(board).find(board_image(board, 900, 1000, 5.0))
    assert found.numbers.tolist() == list(range(len(board.corners)))
    # Pixel k has its middle at k; the board is in the middle of the picture.
    start = (np.array([900, 1000]) - 5e3 * np.array([board.width, board.height])) / 2 - 0.5
    expected = start + 5e3 * board.corners[:, :2]
    np.testing.assert_allclose(found.pixels, expected, atol=0.05)


def test_z_points_into_the_paper_and_y_down():
    """Filmed upright and straight on, the board's axes are the camera's: x right, y down, z ahead."""
    found = Detector(SMALL).find(board_image(SMALL, 900, 800, 5.0))
    K = np.array([[1000.0, 0, 449.5], [0, 1000, 399.5], [0, 0, 1]])
    pose = board_poses([found.pixels], [found.numbers], SMALL, K, np.zeros(5))
    np.testing.assert_allclose(pose.T_camera_board[0, :3, :3], np.eye(3), atol=5e-3)
    # 5 px/mm at 1000 px of focal length is 0.2 m away; the origin is up and left of the middle.
    expected = [-SMALL.width / 2, -SMALL.height / 2, 0.2]
    np.testing.assert_allclose(pose.T_camera_board[0, :3, 3], expected, atol=2e-4)


def test_the_picture_is_the_one_of_opencv():
    board = Board(5, 7, 0.03, 0.021, "DICT_5X5_100")  # 7 cells of 3 mm: whole pixels
    ours = board_image(board, 300, 420, 2.0)
    theirs = np.asarray(board.charuco.generateImage((300, 420), marginSize=0, borderBits=1))
    assert (np.abs(ours.astype(int) - theirs.astype(int)) > 100).mean() < 1e-3


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("tag36h11:80mm", "board-single"),
        ("checkerboard:8x6:25mm", "board-turned"),
        ("checkerboard:7x7:25mm", "board-turned"),
    ],
)
def test_what_tells_no_pose_in_one_picture_is_refused_for_a_mount(text, code):
    with pytest.raises(InputError) as error:
        parse_grid(text)
    assert error.value.code == code


def test_boards_that_tell_a_pose_are_taken_for_a_mount():
    assert parse_grid("checkerboard:9x6:25mm") == Checkerboard(10, 7, 0.025)
    assert parse_grid("A4") == PRESETS["A4"]
