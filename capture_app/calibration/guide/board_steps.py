"""Steps about a printed board: printing it, and where it is on the object."""

import json
from dataclasses import replace
from pathlib import Path

import igl
import numpy as np

from capture_app.calibration.guide.finding import Finding
from capture_app.calibration.guide.phone_steps import AXES, ENOUGH
from capture_app.calibration.guide.placement import astray
from capture_app.calibration.guide.prompt import Prompt, as_path
from capture_app.calibration.guide.steps import AgainError, GuideState, GuideStep, Words
from ingest.calibration.board.board_place import BoardPlace, load_place, place_from_points
from ingest.calibration.board.board_sheet import PAPERS, preset_for
from ingest.calibration.board.board_spec import Board, parse_board
from ingest.calibration.drawing import numbers
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_STRETCHED = 0.1
"""A printer that misses by more has not printed this sheet."""
_OFF_SURFACE = 0.05
"""Metres from the surface to a board on a stiff plate, at most."""
_BESIDE = 0.03
"""Metres before and behind a board where it is looked which side the object is on."""


def _ask_board(prompt: Prompt, state: GuideState) -> Words:
    answer = prompt.ask(
        f"Paper to print it on ({', '.join(PAPERS)}), or the text on a board that you have",
        str(state.board) if state.board else "A4",
    )
    paper = next((name for name in PAPERS if name.lower() == answer.lower()), None)
    board = preset_for(paper) if paper else parse_board(answer)
    if paper:
        if prompt.yes("Write the PDF?", default=True):
            state.run(["board-pdf", "-o", str(state.fresh("board.pdf")), "--paper", paper])
        board = _as_printed(prompt, board)
    state.board = board
    prompt.good(
        f"{board}: {board.columns} x {board.rows} squares, {1e3 * board.width:.1f} x "
        f"{1e3 * board.height:.1f} mm"
    )
    return ["--board", str(board)]


def _as_printed(prompt: Prompt, board: Board) -> Board:
    """The board with the squares that came out of the printer."""
    answer = prompt.ask(
        "If the rulers are not as long as they say, what one says and what it measures in mm, such as "
        "150 148.5 (Enter: they are right)",
        "",
    )
    if not answer:
        return board
    says, measures = numbers(answer, 2, "the ruler").tolist()
    if not abs(measures / says - 1) < _STRETCHED:
        raise InputError(
            "board-printed",
            f"A ruler of {says:g} mm that measures {measures:g} mm was printed on another paper.",
            fix="Print at 100 % (actual size) on the paper that you chose.",
        )
    factor = measures / says
    return replace(
        board, square=round(board.square * factor, 7), marker=round(board.marker * factor, 7)
    )


PRINT = GuideStep(
    "The board",
    (
        "Print the board at 100 % (actual size, not fit to page).",
        "Measure the two rulers on the paper. If both are off by the same part, say so below: no harm "
        "is done. If only one is, the printer pulls the paper: print it again.",
        "Glue it on something flat and stiff, and fix that to the object so that nothing gives. It "
        "stays there while you calibrate; for your takes you may remove it.",
    ),
    _ask_board,
    ("--board", "A4"),
)


def _ask_place(prompt: Prompt, state: GuideState) -> Path:
    """The file that says where the board is, written here or given."""
    board = state.printed
    corners = {
        "top left (where the arrows start)": (0.0, 0.0),
        "top right": (board.width, 0.0),
        "bottom right": (board.width, board.height),
        "bottom left": (0.0, board.height),
    }
    found: dict[str, tuple[float, float, float]] = {}
    for name in corners:
        answer = prompt.until_right(lambda name=name: _corner(prompt, state, name))
        if isinstance(answer, Path):
            return _given(prompt, state, answer)
        if answer is not None:
            found[name] = answer
    on_board = np.array([[*corners[name], 0.0] for name in found]).reshape(-1, 3)
    on_object = np.array(list(found.values())).reshape(-1, 3)
    fit = place_from_points(on_board, on_object, names=list(found))
    few = ("Three points fit nearly always: a fourth would show a mistake.",)
    finding = Finding(
        f"{len(found)} points, which fit the board within {1e3 * fit.rms:.1f} mm",
        astray(state.object_mesh, list(found), on_object, _OFF_SURFACE) + _doubts(state, fit),
        few if len(found) == ENOUGH else (),
    )
    if not prompt.accept(finding):
        raise AgainError
    path = state.fresh("board-place.json")
    points = [
        {"board_mm": [round(1e3 * side, 3) for side in corners[name]], "object": list(xyz)}
        for name, xyz in found.items()
    ]
    path.write_text(json.dumps({"points": points}, indent=2) + "\n", encoding="utf-8")
    prompt.tell(f"Kept in {path}.")
    return path


def _given(prompt: Prompt, state: GuideState, path: Path) -> Path:
    """A file that says it all."""
    fit = load_place(path, state.printed)
    middle = fit.T_object_board @ [state.printed.width / 2, state.printed.height / 2, 0, 1]
    x, y, z = middle[:3]
    finding = Finding(
        f"the board's middle is at {x:.3f} {y:.3f} {z:.3f} m",
        astray(state.object_mesh, ["the board's middle"], middle[None, :3], _OFF_SURFACE)
        + _doubts(state, fit),
    )
    if not prompt.accept(finding):
        raise AgainError
    return path


def _corner(
    prompt: Prompt, state: GuideState, name: str
) -> tuple[float, float, float] | Path | None:
    """A corner's place; a file instead of all of them; nothing for one that is skipped."""
    answer = prompt.ask(name, state.typed.get(name, ""))
    if answer and (path := as_path(answer)).is_file():
        return path
    if not answer:
        return None
    x, y, z = numbers(answer, 3, name).tolist()
    state.typed[name] = answer
    return x, y, z


def _doubts(state: GuideState, fit: BoardPlace) -> tuple[str, ...]:
    if not _faces_inwards(state.object_mesh, state.printed, fit):
        return ()
    return (
        "The board would face into the object. Name the corners as you see them when you look at the "
        "print.",
    )


def _faces_inwards(mesh: ObjectMesh, board: Board, fit: BoardPlace) -> bool:
    """Whether the object is before the board and not behind it; its z goes into the paper."""
    local = np.array([[board.width / 2, board.height / 2, z, 1.0] for z in (-_BESIDE, _BESIDE)])
    at = (local @ fit.T_object_board.T)[:, :3]
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    before, behind = np.abs(np.asarray(igl.fast_winding_number(vertices, faces, at))) > 0.5
    return bool(before and not behind)


def place(option: str) -> GuideStep:
    """Where the board is, by an option of that name."""
    return GuideStep(
        "Where the board is on the object",
        (
            "Look at the print so that the arrows start at its top left.",
            "Find the four outer corners of its chequered area on the mesh, or measure them from "
            "edges that the mesh has; x y z each. Three will do: Enter skips one. A file that says "
            "it all will do as well.",
            AXES,
        ),
        lambda prompt, state: [option, str(_ask_place(prompt, state))],
        (option, "PLACE.json"),
    )
