"""A picture file with a board at true size for a screen."""

import re
from pathlib import Path

import cv2
import numpy as np

from ingest.calibration.board.pattern import board_image
from ingest.calibration.board.spec import Board
from omomo_core.errors import InputError

_MM_PER_INCH = 25.4
_MAX_SIDE = 10_000


def write_screen(board: Board, pixels: str, ppi: float, path: Path) -> None:
    """Write a PNG of exactly the screen's pixels with the board in its middle.

    Args:
        board: what to show.
        pixels: of the screen, as "1170x2532".
        ppi: pixels per inch.
        path: of the PNG; an older one is replaced.

    Raises:
        InputError: "screen-pixels", "screen-ppi", or "board-too-large" with the largest square that
            fits.
    """
    found = re.fullmatch(r"(\d+)\s*x\s*(\d+)", pixels.strip())
    if found is None or max(int(found[1]), int(found[2])) > _MAX_SIDE:
        raise InputError(
            "screen-pixels",
            f"'{pixels}' is no size of a screen.",
            fix="Write width x height in pixels, as in 1170x2532.",
        )
    if not 20 <= ppi <= 2000:
        raise InputError(
            "screen-ppi",
            "The pixels per inch of the screen are needed.",
            fix="Add --ppi, such as 460 for an iPhone 15: it stands in the maker's data sheet.",
        )
    width, height = int(found[1]), int(found[2])
    per_mm = ppi / _MM_PER_INCH
    fits = min(width / board.columns, height / board.rows) / per_mm
    if 1e3 * board.square > fits:
        raise InputError(
            "board-too-large",
            f"The board measures {1e3 * board.width:.0f} x {1e3 * board.height:.0f} mm, the screen "
            f"{width / per_mm:.0f} x {height / per_mm:.0f} mm.",
            where=str(board),
            fix=f"The largest square that fits is {np.floor(10 * fits) / 10:g} mm.",
        )
    written, data = cv2.imencode(".png", board_image(board, width, height, per_mm))
    assert written
    path.write_bytes(data.tobytes())
