"""Where a board sits on the object: from points of the board found on the mesh, or from a matrix."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from pydantic import BaseModel, Field, ValidationError

from ingest.calibration.board.spec import Grid
from ingest.calibration.points.fit import PICKING, rigid_from_points
from ingest.calibration.pose_file import load_pose
from omomo_core import strict_json
from omomo_core.errors import InputError

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
    """Of `ingest.uncertainty`: rotation (rad), then translation (m), in the object's axes."""
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
        what = _first_problem(problem) if isinstance(problem, ValidationError) else str(problem)
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
