"""Boards in one line of text: ChArUco, chessboard, grid of tags, with sizes and corners."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from omomo_core.errors import InputError

_METRES = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254}
LENGTH = r"(\d+(?:\.\d+)?)\s*(mm|cm|m|in)"
"""A length and its unit in such a text."""
_TEXT = re.compile(rf"(\d+)x(\d+):{LENGTH}:{LENGTH}:(\w+)(:legacy)?", re.IGNORECASE)
EXAMPLE = "5x7:35mm:26mm:DICT_5X5_100"
_LOWEST, _HIGHEST = 0.002, 1.0
"""Sides of a square, metres: outside, the unit is wrong."""
MIN_CORNERS = 6
"""Inner corners that a pose is made of, at least: with four or five nothing tells a wrong one."""


@dataclass(frozen=True)
class Grid:
    """A board of squares, black and white in turn.

    Its frame is OpenCV's. With the print upright the origin is the top left corner of the top left
    square, x goes right along the columns, y down along the rows, and z into the paper, away from the
    reader. Points on the board have z = 0.
    """

    columns: int
    """Squares along x."""
    rows: int
    """Squares along y."""
    square: float
    """Side of a square, metres."""

    @property
    def width(self) -> float:
        """Size along x, metres."""
        return self.columns * self.square

    @property
    def height(self) -> float:
        """Size along y, metres."""
        return self.rows * self.square

    @property
    def corners(self) -> Float64[np.ndarray, "corners 3"]:
        """Inner corners of the chessboard in the board's frame by their number, metres.

        Corner 0 is nearest to the origin; numbers go along x first.
        """
        x, y = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
        return flat * self.square


@dataclass(frozen=True)
class Checkerboard(Grid):
    """A plain board of squares; the one at the origin is black where only one way round has that."""

    def __post_init__(self) -> None:
        _check_grid(self)

    def __str__(self) -> str:
        """The text that `parse_reference` reads, which counts inner corners."""
        return f"checkerboard:{self.columns - 1}x{self.rows - 1}:{1e3 * self.square:.6g}mm"

    @property
    def turns(self) -> int:
        """In how many ways it can be turned in its plane and look the same: 1, 2 or 4."""
        if (self.columns + self.rows) % 2:
            return 1
        return 4 if self.columns == self.rows and self.columns % 2 else 2


@dataclass(frozen=True)
class Board(Grid):
    """A chessboard with ArUco markers in its white squares (ChArUco); marker 0 is in the top row."""

    marker: float
    """Side of a marker, metres."""
    dictionary: str = "DICT_5X5_100"
    """Dictionary of the markers, by OpenCV's name."""
    legacy: bool = False
    """Laid out as OpenCV did before 4.6, which differs where the number of rows is even."""

    def __post_init__(self) -> None:
        _check(self)

    def __str__(self) -> str:
        """The text that `parse_board` reads."""
        sides = f"{1e3 * self.square:.6g}mm:{1e3 * self.marker:.6g}mm"
        end = ":legacy" if self.legacy else ""
        return f"{self.columns}x{self.rows}:{sides}:{self.dictionary}{end}"

    @property
    def codes(self) -> cv2.aruco.Dictionary:
        """The markers' patterns."""
        return cv2.aruco.getPredefinedDictionary(dictionaries()[self.dictionary])

    @property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """The same board for OpenCV, in metres."""
        size = (self.columns, self.rows)
        board = cv2.aruco.CharucoBoard(size, self.square, self.marker, self.codes)
        board.setLegacyPattern(self.legacy)
        return board


@cache
def dictionaries() -> dict[str, int]:
    """OpenCV's number of each marker dictionary, by its name."""
    # Some of OpenCV's names are there twice, with a small letter.
    names = [name for name in vars(cv2.aruco) if name.startswith("DICT_") and name.isupper()]
    return {name: int(getattr(cv2.aruco, name)) for name in names}


def check_dictionary(name: str, where: str) -> None:
    """Refuse a marker dictionary that OpenCV does not have.

    Raises:
        InputError: "board-dictionary".
    """
    if name not in dictionaries():
        raise InputError(
            "board-dictionary",
            f"OpenCV has no marker dictionary '{name}'.",
            where=where,
            fix=f"Choose one of {', '.join(dictionaries())}.",
        )


def _check_grid(board: Grid) -> None:
    where = f"{board.columns}x{board.rows}, {1e3 * board.square:g} mm"
    if min(board.columns, board.rows) < 3 or (board.columns - 1) * (board.rows - 1) < MIN_CORNERS:
        raise InputError(
            "board-size",
            f"The board has fewer than {MIN_CORNERS} inner corners.",
            where=where,
            fix="Take at least 3 x 4 squares.",
        )
    check_side(board.square, "square")


def check_side(metres: float, what: str) -> None:
    """Refuse a side that no printed square or marker has.

    Raises:
        InputError: "board-size".
    """
    if not _LOWEST <= metres <= _HIGHEST:
        raise InputError(
            "board-size",
            f"A {what} of {1e3 * metres:g} mm cannot be right.",
            field="board",
            fix="Check the unit: 30mm, 3cm or 0.03m.",
        )


def _check(board: Board) -> None:
    where = f"{board.columns}x{board.rows}, {1e3 * board.square:g} mm"
    check_dictionary(board.dictionary, where)
    _check_grid(board)
    if not 0.2 * board.square <= board.marker < board.square:
        raise InputError(
            "board-size",
            f"A marker of {1e3 * board.marker:g} mm does not fit well into a square of "
            f"{1e3 * board.square:g} mm.",
            where=where,
            fix="Make the marker about 3/4 of the square; the square comes first.",
        )
    markers, most = board.columns * board.rows // 2, len(board.codes.bytesList)
    if markers > most:
        raise InputError(
            "board-dictionary",
            f"The board needs {markers} markers, {board.dictionary} has {most}.",
            where=where,
            fix="Take a larger dictionary or fewer squares.",
        )


PRESETS = {
    "A4": Board(5, 7, 0.035, 0.026),
    "Letter": Board(5, 7, 0.033, 0.0245),
    "A3": Board(5, 7, 0.052, 0.039),
}
"""The board that fills a sheet of each paper."""


def parse_board(text: str) -> Board:
    """The board of a text such as "5x7:30mm:22mm:DICT_5X5_250", or of a paper's preset ("A4").

    That is columns x rows of squares, side of a square, side of a marker, dictionary, and
    ":legacy" for the layout before OpenCV 4.6. Sides are in mm, cm, m or in.

    Raises:
        InputError: "board-text" when it is not of that form; "board-size" or "board-dictionary"
            when there is no such board.
    """
    for name, preset in PRESETS.items():
        if text.strip().lower() == name.lower():
            return preset
    found = _TEXT.fullmatch(text.strip())
    if found is None:
        raise InputError(
            "board-text",
            f"'{text}' does not describe a board.",
            fix=f"Write columns x rows, square, marker and dictionary, as in {EXAMPLE}; "
            f"or name a preset: {', '.join(PRESETS)}.",
        )
    columns, rows, square, square_unit, marker, marker_unit, dictionary, legacy = found.groups()
    return Board(
        int(columns),
        int(rows),
        metres_of(square, square_unit),
        metres_of(marker, marker_unit),
        dictionary.upper(),
        legacy is not None,
    )


def metres_of(number: str, unit: str) -> float:
    """Metres of a number and its unit (mm, cm, m or in).

    They are rounded to a nanometre, so that one length is the same in every unit.
    """
    return round(float(number) * _METRES[unit.lower()], 9)


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
            fix="Add ‹ppi›, such as 460 for an iPhone 15: it stands in the maker's data sheet.",
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
