"""Tags, and Reference: whatever printed thing tells size and pose, in one line of text."""

import re
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.spec import (
    EXAMPLE,
    LENGTH,
    PRESETS,
    Board,
    Checkerboard,
    check_dictionary,
    check_side,
    dictionaries,
    metres_of,
    parse_board,
)
from omomo_core.errors import InputError

_CHECKERBOARD = re.compile(rf"checkerboard:(\d+)x(\d+):{LENGTH}", re.IGNORECASE)
_TAG = re.compile(rf"(?!checkerboard\b)([a-z]\w*):{LENGTH}(?::(\d+))?", re.IGNORECASE)
_APRILTAG = re.compile(r"(?:apriltag_?|tag_?)(\d+)[_x]?h(\d+)", re.IGNORECASE)
EXAMPLES = "tag36h11:80mm, DICT_4X4_50:50mm:7, checkerboard:9x6:25mm"
"""Texts of references that are no ChArUco board."""


@dataclass(frozen=True)
class Tags:
    """Single markers of one dictionary and one size: AprilTags or ArUco markers.

    The frame of each is that of a board: with the marker upright the origin is its top left corner, x
    goes right, y down, and z into the paper. Corners 0 to 3 go round from the origin along x first.
    """

    dictionary: str
    """By OpenCV's name, e.g. DICT_APRILTAG_36H11."""
    side: float
    """Of the black square, without the white around it, metres."""
    number: int | None = None
    """Of the one marker that counts; None takes all."""

    def __post_init__(self) -> None:
        check_dictionary(self.dictionary, str(self))
        check_side(self.side, "marker")
        most = len(self.codes.bytesList)
        if self.number is not None and self.number >= most:
            raise InputError(
                "board-number",
                f"{self.dictionary} has no marker {self.number}.",
                where=str(self),
                fix=f"Its markers are 0 to {most - 1}.",
            )

    def __str__(self) -> str:
        """The text that `parse_reference` reads."""
        end = "" if self.number is None else f":{self.number}"
        return f"{self.dictionary}:{1e3 * self.side:.6g}mm{end}"

    @property
    def corners(self) -> Float64[np.ndarray, "4 3"]:
        """Corners of one marker in its frame by their number, metres."""
        return self.side * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])

    @property
    def codes(self) -> cv2.aruco.Dictionary:
        """The markers' patterns."""
        return cv2.aruco.getPredefinedDictionary(dictionaries()[self.dictionary])


Reference = Board | Checkerboard | Tags


def parse_reference(text: str) -> Reference:
    """The reference of a text.

    A ChArUco board is written as `parse_board` reads it. A plain checkerboard is
    "checkerboard:9x6:25mm": inner corners, and the side of a square. Markers are "tag36h11:80mm" or
    "DICT_4X4_50:50mm:7": the family, the side of the black square, and the number if only one counts.

    Raises:
        InputError: "board-text", "board-size", "board-dictionary" or "board-number".
    """
    stripped = text.strip()
    if found := _CHECKERBOARD.fullmatch(stripped):
        columns, rows, number, unit = found.groups()
        return Checkerboard(int(columns) + 1, int(rows) + 1, metres_of(number, unit))
    if found := _TAG.fullmatch(stripped):
        family, number, unit, which = found.groups()
        side = metres_of(number, unit)
        return Tags(_dictionary(family), side, None if which is None else int(which))
    try:
        return parse_board(stripped)
    except InputError as error:
        if error.code != "board-text":
            raise
        raise InputError(
            "board-text",
            f"'{text}' describes no board and no marker.",
            fix=f"Write a ChArUco board as in {EXAMPLE} or name its paper ({', '.join(PRESETS)}); "
            f"others as in {EXAMPLES}.",
        ) from None


def parse_grid(text: str) -> Board | Checkerboard:
    """The reference of a text, if one picture of it tells a pose.

    Raises:
        InputError: as `parse_reference`; "board-single" for markers, "board-turned" for a checkerboard
            that looks the same when it is turned.
    """
    reference = parse_reference(text)
    if isinstance(reference, Tags):
        raise InputError(
            "board-single",
            "The four corners of a single marker do not tell its pose well enough here.",
            where=str(reference),
            fix="Use a board: `omocap calibrate board-pdf` makes one. A scan takes markers for the size.",
        )
    if isinstance(reference, Checkerboard) and reference.turns > 1:
        raise InputError(
            "board-turned",
            "This checkerboard looks the same when it is turned by half a turn.",
            where=str(reference),
            fix="Use one with an odd number of inner corners along one side and an even number along "
            "the other, such as 9x6, or a ChArUco board.",
        )
    return reference


def _dictionary(family: str) -> str:
    """OpenCV's name of a family, which the makers of AprilTag call tag36h11."""
    found = _APRILTAG.fullmatch(family)
    return f"DICT_APRILTAG_{found[1]}H{found[2]}" if found else family.upper()
