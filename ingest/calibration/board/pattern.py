"""The black and white of a board as rectangles, and pictures of it, also at true size for a screen."""

import re
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from ingest.calibration.board.spec import Board
from omomo_core.errors import InputError


class Pattern(NamedTuple):
    """Rectangles (x, y of the corner nearest the origin, width, height) in the board's frame, metres.

    White lies on black; rectangles of one colour do not overlap.
    """

    black: Float64[np.ndarray, "rectangles 4"]
    white: Float64[np.ndarray, "rectangles 4"]


def pattern(board: Board) -> Pattern:
    """The black and white rectangles of the board."""
    charuco = board.charuco
    starts = np.array([np.reshape(m, (-1, 3))[0, :2] for m in charuco.getObjPoints()], float)
    numbers = np.asarray(charuco.getIds()).ravel()
    held = {(int(x // board.square), int(y // board.square)) for x, y in starts}
    squares = [
        (c * board.square, r * board.square, board.square, board.square)
        for r in range(board.rows)
        for c in range(board.columns)
        if (c, r) not in held
    ]
    markers = [(x, y, board.marker, board.marker) for x, y in starts]
    white = [_bits(board, int(n), start) for n, start in zip(numbers, starts, strict=True)]
    return Pattern(np.array(squares + markers), np.concatenate(white))


def _bits(
    board: Board, number: int, start: Float64[np.ndarray, "2"]
) -> Float64[np.ndarray, "bits 4"]:
    """White cells of a marker whose first corner is at `start`."""
    cells = board.codes.markerSize + 2
    image = np.asarray(cv2.aruco.generateImageMarker(board.codes, number, cells, borderBits=1))
    rows, columns = np.nonzero(image)
    side = board.marker / cells
    at = start + side * np.stack([columns, rows], axis=1)
    return np.hstack([at, np.full((len(at), 2), side)])


def board_image(
    board: Board, width_px: int, height_px: int, px_per_mm: float
) -> UInt8[np.ndarray, "height_px width_px"]:
    """A grey picture with the board at true size in its middle, for a screen or a texture.

    Edges between pixels are grey in the right share, so that the size is exact.

    Args:
        board: what to draw.
        width_px, height_px: of the picture; what of the board is beyond is cut off.
        px_per_mm: pixels per millimetre of the screen.
    """
    scale = 1e3 * px_per_mm
    shift = np.array([width_px - scale * board.width, height_px - scale * board.height]) / 2
    ink = np.zeros((height_px, width_px))
    drawn = pattern(board)
    for sign, rectangles in ((1.0, drawn.black), (-1.0, drawn.white)):
        starts = rectangles[:, :2] * scale + shift
        ends = starts + rectangles[:, 2:] * scale
        across = _coverage(starts[:, 0], ends[:, 0], width_px)
        down = _coverage(starts[:, 1], ends[:, 1], height_px)
        ink += sign * down.T @ across
    return np.rint(255 * (1 - ink.clip(0, 1))).astype(np.uint8)


def _coverage(
    starts: Float64[np.ndarray, " n"], ends: Float64[np.ndarray, " n"], count: int
) -> Float64[np.ndarray, "n count"]:
    """How much of each pixel lies between start and end; pixel k reaches from k to k + 1."""
    pixels = np.arange(count)
    inside = np.minimum(ends[:, None], pixels + 1) - np.maximum(starts[:, None], pixels)
    return inside.clip(0, 1)


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
