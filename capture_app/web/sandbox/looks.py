"""A quick look at what was recorded for a calibration, as the guide of the command line has it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np

from capture_app.calibration.guide_recordings import (
    filmed_board,
    filmed_rest,
    filmed_then_clamped,
    rested_recording,
    turned_recording,
)
from capture_app.calibration.guide_steps import Finding
from ingest.calibration.board.board_spec import Board, parse_board
from ingest.calibration.hand_eye.to_mount import read_pose_log
from ingest.formats.registry import read_session
from omomo_core.errors import InputError

Look = Literal["turned", "rested", "filmed", "still", "film", "poses"]
"""A recording that was turned about, or rests after the clamping, or shows the board before it, or
has pictures at rest; the film of a second camera; a tracker's log."""


def look(path: Path, what: Look, board: str) -> dict[str, Any]:
    """What it can be used for, and what may spoil the result.

    Args:
        path: what was recorded.
        what: the kind of look.
        board: for a look that needs the printed board.

    Raises:
        InputError: it cannot be used, with what to do better.
    """
    looks: dict[Look, Callable[[], Finding]] = {
        "turned": lambda: turned_recording(read_session(path)),
        "rested": lambda: rested_recording(read_session(path)),
        "still": lambda: filmed_rest(read_session(path)),
        "filmed": lambda: filmed_then_clamped(read_session(path), _board(board)),
        "film": lambda: filmed_board(path, _board(board)),
        "poses": lambda: _poses(path),
    }
    return looks[what]()._asdict()


def _board(text: str) -> Board:
    if not text:
        raise InputError(
            "board-needed", "Which board it is must be known first.", fix="Choose the board."
        )
    return parse_board(text)


def _poses(path: Path) -> Finding:
    times = read_pose_log(path).times
    rate, seconds = 1 / float(np.median(np.diff(times))), float(np.ptp(times))
    return Finding(f"{len(times):,} poses, {rate:.0f} a second, {seconds:.0f} s")
