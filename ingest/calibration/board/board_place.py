"""Places of boards and tags on the object, and references that tell size and pose."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32, Float64
from pydantic import BaseModel, Field, ValidationError

from ingest.calibration.board.board_detect import Grey
from ingest.calibration.board.board_spec import (
    EXAMPLE,
    LENGTH,
    PRESETS,
    Board,
    Checkerboard,
    Grid,
    check_dictionary,
    check_side,
    dictionaries,
    metres_of,
    parse_board,
)
from ingest.calibration.point_pairs import PICKING, rigid_from_points
from ingest.calibration.pose_file import load_pose
from omomo_core import strict_json
from omomo_core.errors import InputError, in_words

_TURN = np.radians(1.0)
"""One sigma of a rotation that a matrix gives; it does not say how sure it is."""
_MAX_BYTES = 2**20
_EXAMPLE = (
    '{"points": [{"corner": 0, "object": [0.10, 0.20, 0.30]}, {"board_mm": [175, 0], '
    '"object": [0.27, 0.20, 0.30]}, ...]}'
)


class _Point(BaseModel):
    corner: int | None = Field(default=None, ge=0)
    board_mm: tuple[float, float] | None = None
    object: tuple[float, float, float]


class _PlaceFile(BaseModel):
    points: list[_Point]
    sigma_mm: float = Field(default=1e3 * PICKING, gt=0)


@dataclass(frozen=True)
class BoardPlace:
    """The constant pose of a board in the frame of the object's mesh."""

    T_object_board: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`: rotation (rad), then translation (m), in the object's axes."""
    rms: float
    """Distance left between the points, metres; 0 for a matrix."""


def place_from_points(
    board_points: Float64[np.ndarray, "n 3"],
    object_points: Float64[np.ndarray, "n 3"],
    sigma: float = PICKING,
    names: Sequence[str] = (),
) -> BoardPlace:
    """The place from three or more points of the board whose positions on the mesh are known.

    Args:
        board_points: in the board's frame, metres.
        object_points: the same points in the mesh's frame, metres.
        sigma: how far a point on the mesh is off along each axis, metres.
        names: of the points, for messages.

    Raises:
        InputError: of `rigid_from_points`.
    """
    fit = rigid_from_points(object_points, board_points, sigma, names=names)
    return BoardPlace(fit.T_a_b, fit.covariance, fit.rms)


def load_place(path: Path, board: Grid) -> BoardPlace:
    """Read the place of a board on the object.

    A JSON file holds "points", each with "object" (x, y, z in the mesh's frame, metres) and either
    "corner" (number of an inner corner: 0 is nearest to the origin, x first) or "board_mm" (x, y on
    the print from its origin, millimetres), and "sigma_mm" if the points are not sure to 2 mm. A CSV
    file holds the points in columns named corner, x, y, z or board_x_mm, board_y_mm, x, y, z. Any
    other file holds T_object_board, four rows of four, taken as sure to 2 mm and 1 degree.

    Raises:
        InputError: "place-missing", "place-unreadable", "place-corner", or of `rigid_from_points`
            or `load_pose`.
    """
    if not path.is_file():
        raise InputError(
            "place-missing",
            "There is no file that says where the board is on the object.",
            where=str(path),
            fix=f"Measure three or more of its corners on the mesh and write {_EXAMPLE}.",
        )
    text = path.read_bytes()[:_MAX_BYTES].decode("utf-8", "replace").lstrip("\ufeff \n")
    if not text.startswith(("{", "corner", "board_x_mm")):
        return BoardPlace(load_pose(path), np.diag([_TURN**2] * 3 + [PICKING**2] * 3), 0.0)
    try:
        json_file = text.startswith("{")
        file = _PlaceFile.model_validate(strict_json.parse(text)) if json_file else _from_csv(text)
        return _from_points(file, board)
    except (ValueError, KeyError) as problem:
        what = (
            _first_problem(problem) if isinstance(problem, ValidationError) else in_words(problem)
        )
        raise InputError(
            "place-unreadable",
            f"The board's place cannot be read: {what}.",
            where=str(path),
            fix=f"Write {_EXAMPLE}.",
        ) from None


def _first_problem(problem: ValidationError) -> str:
    error = problem.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(str(part) for part in error['loc'])}: {error['msg']}"


def _from_csv(text: str) -> _PlaceFile:
    rows = csv.DictReader(text.splitlines(), skipinitialspace=True)
    points = [
        {
            "corner": row.get("corner"),
            "board_mm": None if "corner" in row else (row["board_x_mm"], row["board_y_mm"]),
            "object": (row["x"], row["y"], row["z"]),
        }
        for row in rows
    ]
    return _PlaceFile.model_validate({"points": points})


def _from_points(file: _PlaceFile, board: Grid) -> BoardPlace:
    pairs = [_on_board(point, board) for point in file.points]
    on_object = np.array([point.object for point in file.points], float).reshape(-1, 3)
    on_board = np.array([where for _, where in pairs], float).reshape(-1, 3)
    return place_from_points(on_board, on_object, file.sigma_mm / 1e3, [name for name, _ in pairs])


def _on_board(point: _Point, board: Grid) -> tuple[str, Float64[np.ndarray, "3"]]:
    """Name of a point, and where it is on the board."""
    if point.corner is None:
        if point.board_mm is None:
            raise ValueError("a point has neither 'corner' nor 'board_mm'")
        x, y = point.board_mm
        return f"board point {x:g}, {y:g} mm", np.array([x / 1e3, y / 1e3, 0.0])
    if point.corner >= len(board.corners):
        raise InputError(
            "place-corner",
            f"The board {board} has no corner {point.corner}.",
            fix=f"Its inner corners are 0 to {len(board.corners) - 1}, along x first.",
        )
    return f"corner {point.corner}", board.corners[point.corner]


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
    """OpenCV's name of the dictionary, e.g. DICT_APRILTAG_36H11."""
    side: float
    """Side of the black square, without the white around it, metres."""
    number: int | None = None
    """Number of the one marker that counts; None takes all."""

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
            fix="Use a board: ‹omocap calibrate board-pdf› makes one. A scan takes markers for the size.",
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


_SAMPLES = 16
"""Places along a side of a marker at which its edge is looked for."""
_ENDS = 0.12
"""Part of a side at each end that is left out: blur rounds the corners."""
_REACH = 0.45
"""How far across the edge is looked, in cells: half of the black border and of the white around it."""
_STEPS = 21
"""Samples across the edge."""
_ROUNDS = 3


class TagDetector:
    """Finds single markers in pictures."""

    def __init__(self, tags: Tags) -> None:
        self._detector = cv2.aruco.ArucoDetector(tags.codes)
        self._cells = tags.codes.markerSize + 2
        self._number = tags.number

    def find(self, grey: Grey) -> dict[int, Float64[np.ndarray, "4 2"]]:
        """The corners of each marker seen, pixels, in the order of `Tags.corners`.

        A marker whose number is there twice is left out: which is which is not known.
        """
        found: Any = self._detector.detectMarkers(grey)
        corners, numbers = found[0], found[1]
        listed = [] if numbers is None else np.ravel(numbers).tolist()
        return {
            number: _refined(grey, np.asarray(corner, np.float64).reshape(4, 2), self._cells)
            for number, corner in zip(listed, corners, strict=True)
            if listed.count(number) == 1 and self._number in (None, number)
        }


def _refined(
    grey: Grey, corners: Float64[np.ndarray, "4 2"], cells: int
) -> Float64[np.ndarray, "4 2"]:
    """Corners where lines through the edges of the four sides meet.

    OpenCV's own ways make a marker too small by half a pixel to a whole one at each side, or shift it.
    """
    for _ in range(_ROUNDS):
        lines = [_edge(grey, corners[k], corners[(k + 1) % 4], cells) for k in range(4)]
        meets = np.array([np.cross(lines[k - 1], lines[k]) for k in range(4)])
        found = meets[:, :2] / meets[:, 2:]
        side = np.linalg.norm(corners[2] - corners[0]) / 2
        if not np.isfinite(found).all() or np.abs(found - corners).max() > side / cells:
            return corners
        corners = found
    return corners


def _edge(
    grey: Grey, a: Float64[np.ndarray, "2"], b: Float64[np.ndarray, "2"], cells: int
) -> Float64[np.ndarray, "3"]:
    """The line (n, d) with n x + d = 0 along which it turns from black to white between two corners."""
    side = float(np.linalg.norm(b - a))
    # Corners go round with the inside at the right hand, where y points down.
    along = (b - a) / side
    outward = np.array([along[1], -along[0]])
    across = np.linspace(-1, 1, _STEPS) * max(_REACH * side / cells, 1.0)
    starts = a + np.linspace(_ENDS, 1 - _ENDS, _SAMPLES)[:, None] * (b - a)
    profiles = _sampled(grey, starts[:, None] + across[:, None] * outward)
    steps = np.diff(profiles, axis=1).clip(0)
    middles = (across[1:] + across[:-1]) / 2
    weight = steps.sum(axis=1)
    off = steps @ middles / np.maximum(weight, 1e-9)
    points = starts + off[:, None] * outward
    strong = weight > 0.5 * np.median(weight)
    return _line(points[strong & (np.abs(off - np.median(off[strong])) < 1.0)], outward)


def _line(
    points: Float64[np.ndarray, "points 2"], outward: Float64[np.ndarray, "2"]
) -> Float64[np.ndarray, "3"]:
    """The line of least squares through points."""
    if len(points) < 2:
        return np.full(3, np.nan)
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle)[2][-1]
    normal = normal if normal @ outward > 0 else -normal
    return np.array([*normal, -normal @ middle])


def _sampled(
    grey: Grey, places: Float64[np.ndarray, "sides across 2"]
) -> Float32[np.ndarray, "sides across"]:
    """Brightness between pixels."""
    x, y = (np.ascontiguousarray(places[..., k], np.float32) for k in range(2))
    sampled = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, np.float32)
