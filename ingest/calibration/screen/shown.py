"""What the phone shows on its screen, and where that is in the frame of its camera."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, cast

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from ingest.calibration.board.board_spec import Board, board_image
from ingest.calibration.phone_body import Phone, phone_body
from ingest.uncertainty import of_product, rotation
from omomo_core import strict_json
from omomo_core.errors import InputError, reader_complaint

_COLUMNS, _ROWS = 5, 9
_DICTIONARY = "DICT_4X4_50"
"""Not the one of printed boards, so that the two are never mixed up in one picture."""
_SIDE, _END = 0.0015, 0.0150
"""Metres left free at the screen's long sides, and at its round ends with the front camera."""
_LINES = (("TOP: at the front camera", 0.0125), ("{phone}", -0.0090))
"""What is written, and where its foot is from the screen's top (bottom if negative), metres."""
_LETTERS = 0.0022
_BEHIND_GLASS = 0.0005
"""Metres by which the picture seems to lie behind the front glass."""
_SCREEN_SIGMA = 0.0003
TURNS = (0, 90, 180, 270)


class ScreenPose(NamedTuple):
    """T_phone_screen and its covariance; both shared by all the pictures."""

    T_phone_screen: Float64[np.ndarray, "4 4"]
    """Maps the screen's frame into the phone's camera: origin in the screen's middle, x to the
    right and y to the bottom as you look at it, z into the phone."""
    covariance: Float64[np.ndarray, "6 6"]


def screen_board(phone: Phone) -> Board:
    """The board that fills a phone's screen but for its round ends.

    Raises:
        InputError: "screen-unknown".
    """
    width, height = _screen(phone)[0]
    square = min((width - 2 * _SIDE) / _COLUMNS, (height - 2 * _END) / _ROWS)
    square = np.floor(square * 1e4) / 1e4
    return Board(_COLUMNS, _ROWS, float(square), float(0.75 * square), _DICTIONARY)


def screen_picture(phone: Phone) -> UInt8[np.ndarray, "height width"]:
    """The picture to open full screen on the phone: the board at true size, and which end is up.

    Raises:
        InputError: "screen-unknown".
    """
    (width, _), (across, down) = _screen(phone)
    scale = across / width
    image = np.ascontiguousarray(board_image(screen_board(phone), across, down, scale / 1e3))
    thick = max(1, round(0.0002 * scale))
    size = _LETTERS * scale / cv2.getTextSize("T", _FONT, 1.0, 1)[0][1]
    for line, foot in _LINES:
        text = line.format(phone=phone.name)
        wide = cv2.getTextSize(text, _FONT, size, thick)[0][0]
        at = ((across - wide) // 2, round(foot * scale) % down)
        cv2.putText(image, text, at, _FONT, size, 0, thick, cv2.LINE_AA)
    return image


_FONT = cv2.FONT_HERSHEY_SIMPLEX


def screen_pose(phone: Phone) -> ScreenPose:
    """Where the screen is in the phone's camera frame, from the model's sizes."""
    _screen(phone)
    T_body_screen = np.diag([1.0, -1.0, -1.0, 1.0])
    T_body_screen[2, 3] = -_BEHIND_GLASS
    of_screen = np.diag([0.0] * 3 + [_SCREEN_SIGMA**2] * 3)
    T_phone_body, of_body = phone_body(phone)
    covariance = of_product(T_phone_body, of_body, T_body_screen, of_screen)
    return ScreenPose(T_phone_body @ T_body_screen, covariance)


def shown_board(phone: Phone, turned: int) -> Board:
    """The board as it is on the screen when the phone turned the picture.

    A picture turned by 90 or 270 degrees is shrunk so that its length fits the screen's width.
    """
    board = screen_board(phone)
    if turned % 180 == 0:
        return board
    across, down = _screen(phone)[1]
    shrink = across / down
    return replace(board, square=board.square * shrink, marker=board.marker * shrink)


def screen_of_board(board: Board, turned: int) -> Float64[np.ndarray, "4 4"]:
    """T_screen_board: the board in the middle of the screen, turned clockwise by degrees.

    Raises:
        InputError: "screen-turned".
    """
    if turned not in TURNS:
        raise InputError(
            "screen-turned",
            f"A picture cannot stand turned by {turned} degrees.",
            where="--turned",
            fix="Give 0, 90, 180 or 270, clockwise.",
        )
    T = np.eye(4)
    T[:3, :3] = rotation(np.array([0.0, 0.0, np.radians(turned)]))
    T[:3, 3] = -T[:3, :3] @ [board.width / 2, board.height / 2, 0]
    return T


def load_screen_pose(path: Path) -> ScreenPose:
    """Read where the screen of one phone was found to be: {"T_phone_screen": ..., "covariance": ...}.

    Raises:
        InputError: "phone-file".
    """
    try:
        table = cast(dict[str, Any], strict_json.parse(path.read_bytes()[:_MAX_BYTES]))
        T = np.array(table["T_phone_screen"], float).reshape(4, 4)
        covariance = np.array(table["covariance"], float).reshape(6, 6)
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise _no_phone_file(path, reader_complaint(problem)) from None
    R = T[:3, :3]
    if not (np.isfinite(T).all() and np.abs(R @ R.T - np.eye(3)).max() < 1e-3):
        raise _no_phone_file(path, "T_phone_screen is not rigid")
    if not (np.isfinite(covariance).all() and np.linalg.eigvalsh(covariance).min() > 0):
        raise _no_phone_file(path, "the covariance is none")
    return ScreenPose(T, covariance)


def save_screen_pose(pose: ScreenPose, phone: str, path: Path) -> None:
    """Write what `load_screen_pose` reads."""
    table = {
        "phone": phone,
        "T_phone_screen": pose.T_phone_screen.tolist(),
        "covariance": pose.covariance.tolist(),
    }
    path.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")


_MAX_BYTES = 2**20


def _no_phone_file(path: Path, why: str) -> InputError:
    return InputError(
        "phone-file",
        f"The file of a phone's screen cannot be read: {why}.",
        where=str(path),
        fix="Make it with `omocap calibrate screen ... --learn MOUNT`.",
    )


def _screen(phone: Phone) -> tuple[tuple[float, float], tuple[int, int]]:
    if phone.screen is None or phone.pixels is None:
        raise InputError(
            "screen-unknown",
            f"The screen of '{phone.name}' is not known.",
            where="--phone",
            fix="Name a known iPhone, or use another way to calibrate.",
        )
    return phone.screen, phone.pixels
