"""Steps of the guide about the phone, the printed board, and files that are there already."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from capture_app.calibration.guide_steps import (
    AgainError,
    Finding,
    GuideState,
    GuideStep,
    Prompt,
    Words,
    as_path,
    astray,
)
from capture_app.calibration.mount_look import ENOUGH, HELD_OFF, fit_of_points
from ingest.calibration.board.board_place import BoardPlace, load_place, place_from_points
from ingest.calibration.board.board_sheet import PAPERS, preset_for
from ingest.calibration.board.board_spec import Board, parse_board
from ingest.calibration.drawn_mount import MEASURED, PRINTED, numbers, rotation_in_words
from ingest.calibration.phone_body import body_point, phone_named
from ingest.calibration.picked_points import MAX_OFFSET
from ingest.calibration.point_pairs import PointPair, load_pairs, save_pairs
from ingest.calibration.pose_file import load_similarity
from ingest.calibration.session_mount import load_scan
from ingest.colmap import read_model
from ingest.mesh import load_mesh
from omomo_core.errors import InputError
from omomo_core.geometry.surface import inside_mesh
from omomo_core.motion import ObjectMesh

AXES = (
    "Numbers are x y z in metres in the mesh's own frame, as a 3D program shows it. Blender turns an "
    "OBJ on import unless you choose Y forward and Z up; a GLB is read as Blender shows it (z up)."
)
_PRECISIONS = (
    ("printed or milled after the drawing", PRINTED),
    ("measured with a ruler and by eye", MEASURED),
)
POINTS: tuple[str, ...] = (
    "top left back corner",
    "top right back corner",
    "bottom left back corner",
    "bottom right back corner",
    "top middle back",
    "bottom middle back",
    "left middle back",
    "right middle back",
    "top left front corner",
    "top right front corner",
    "bottom left front corner",
    "bottom right front corner",
    "top middle front",
    "bottom middle front",
    "left middle front",
    "right middle front",
    "centre back",
    "centre front",
    "lens",
)
"""Points of the phone that are offered."""


def _ask_model(prompt: Prompt, state: GuideState) -> Words:
    name = prompt.ask('Model of the phone, such as "iPhone 15"')
    words = ["--phone", name]
    try:
        phone = phone_named(name)
    except InputError as error:
        if error.code not in ("phone-unknown", "phone-lens"):
            raise
        prompt.problem(error)
        ruler = prompt.ask("Those four numbers, or nothing to type the model again", "")
        if not ruler:
            raise AgainError from None
        width, height, top, side = numbers(ruler, 4, "--ruler").tolist()
        phone = phone_named(name, (width, height, top, side))
        words += ["--ruler", ruler]
    state.phone = phone
    width, height, thickness = (1e3 * side for side in phone.body)
    prompt.good(f"{phone.name}, {width:.1f} x {height:.1f} x {thickness:.1f} mm without its case")
    return words


MODEL = GuideStep("The phone", (), _ask_model, ("--phone", "MODEL"))


def _ask_points(prompt: Prompt, state: GuideState) -> Words:
    typed = _typed_points(prompt)
    path = typed if isinstance(typed, Path) else _kept(prompt, state, typed)
    if not prompt.accept(_check_pairs(load_pairs(path), state)):
        raise AgainError
    return [str(path)]


def _kept(prompt: Prompt, state: GuideState, pairs: Sequence[PointPair]) -> Path:
    """Write what was typed before it is judged, so that a wrong number can be mended."""
    path = state.fresh("points.json")
    save_pairs(pairs, path)
    prompt.tell(f"Kept in {path}.")
    return path


def _typed_points(prompt: Prompt) -> Path | list[PointPair]:
    """Return the named points whose places the person knows, or those of a file."""
    prompt.tell(
        f"{AXES} To click the points on the mesh, open the page instead (omocap serve). Enter skips a "
        "point that you cannot reach; the word done ends the list. You may also give a file of pairs (CSV "
        "or JSON), such as one that was kept."
    )
    pairs: list[PointPair] = []
    for name in POINTS:
        answer = prompt.until_right(lambda name=name: _typed_point(prompt, name, len(pairs)))
        if isinstance(answer, Path):
            return answer
        if answer == "done":
            break
        if isinstance(answer, PointPair):
            pairs.append(answer)
    return pairs


def _typed_point(prompt: Prompt, name: str, count: int) -> PointPair | Path | str:
    """The pair of a point, a file of pairs, "done", or nothing."""
    answer = prompt.ask(f"{name} ({count} so far)", "")
    if answer in ("", "done"):
        return answer
    if (path := as_path(answer)).is_file():
        return path
    x, y, z = numbers(answer, 3, name).tolist()
    return PointPair(name, (x, y, z))


def _check_pairs(pairs: list[PointPair], state: GuideState) -> Finding:
    return fit_of_points(pairs, state.model, state.object_mesh).finding


PICKED = GuideStep(
    "Points",
    (
        "Clamp the phone where it is to stay.",
        "Find four or five points of the phone on the mesh, or where they would be beside it: far "
        "apart, and not all in one plane. Left and right are as you look at the screen, the top is "
        "the end with the front camera.",
    ),
    _ask_points,
    ("POINTS.json",),
)


def _ask_drawn_place(prompt: Prompt, state: GuideState) -> Words:
    words: Words = []
    point = prompt.ask('Which point of the phone the drawing gives, such as "lens"', "centre front")
    body_point(state.model, point)
    if point != "centre front":
        words += ["--point", point]
    xyz = prompt.ask("Where that is, x y z")
    place = numbers(xyz, 3, "x y z")
    if np.linalg.norm(place) > MAX_OFFSET:
        raise InputError(
            "drawing-units",
            f"That is {np.linalg.norm(place):.0f} m from the object's origin.",
            fix="Give metres: 120 mm are 0.12.",
        )
    off = astray(state.object_mesh, [point], place[None], HELD_OFF)
    if not prompt.accept(Finding(f"{point} at {' '.join(f'{x:g}' for x in place)} m", off)):
        raise AgainError
    return [*words, "--xyz", xyz]


DRAWN_PLACE = GuideStep("Where the phone is", (AXES,), _ask_drawn_place, ("--xyz", "X Y Z"))


def _ask_drawn_turn(prompt: Prompt, state: GuideState) -> Words:
    axes = prompt.ask('How it is turned, such as "screen faces +x, top edge points +z"')
    rotation_in_words(axes)
    prompt.tell("How well is that known?")
    chosen = prompt.choose("Number", [name for name, _ in _PRECISIONS])
    precision = _PRECISIONS[chosen][1]
    mm, deg = 1e3 * precision.metres, np.degrees(precision.radians)
    prompt.good(f"taken as right to {mm:g} mm and {deg:g} deg (one standard deviation)")
    return ["--axes", axes, "--sigma-mm", f"{mm:g}", "--sigma-deg", f"{deg:g}"]


DRAWN_TURN = GuideStep(
    "How the phone is turned",
    (
        "Say where two of its sides point along the mesh's axes. Sides are screen, back, top, bottom, "
        "left and right, as you look at the screen; a slanted one is written back faces (0, 0.5, "
        "-0.87).",
    ),
    _ask_drawn_turn,
    ("--axes", "SCREEN FACES ?, TOP EDGE POINTS ?"),
)


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
    measured: dict[str, tuple[float, float, float]] = {}
    for name in corners:
        answer = prompt.until_right(lambda name=name: _corner(prompt, state, name))
        if isinstance(answer, Path):
            return _given(prompt, state, answer)
        if answer is not None:
            measured[name] = answer
    on_board = np.array([[*corners[name], 0.0] for name in measured]).reshape(-1, 3)
    on_object = np.array(list(measured.values())).reshape(-1, 3)
    fit = place_from_points(on_board, on_object, names=list(measured))
    few = ("Three points fit nearly always: a fourth would show a mistake.",)
    finding = Finding(
        f"{len(measured)} points, which fit the board within {1e3 * fit.rms:.1f} mm",
        astray(state.object_mesh, list(measured), on_object, _OFF_SURFACE) + _doubts(state, fit),
        few if len(measured) == ENOUGH else (),
    )
    if not prompt.accept(finding):
        raise AgainError
    path = state.fresh("board-place.json")
    points = [
        {"board_mm": [round(1e3 * side, 3) for side in corners[name]], "object": list(xyz)}
        for name, xyz in measured.items()
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
    before, behind = inside_mesh(mesh, at)
    return bool(before and not behind)


BOARD_PLACE = GuideStep(
    "Where the board is on the object",
    (
        "Look at the print so that the arrows start at its top left.",
        "Find the four outer corners of its chequered area on the mesh, or measure them from "
        "edges that the mesh has; x y z each. Three will do: Enter skips one. A file that says "
        "it all will do as well.",
        AXES,
    ),
    lambda prompt, state: ["--board-place", str(_ask_place(prompt, state))],
    ("--board-place", "PLACE.json"),
)


def _ask_mesh(prompt: Prompt, state: GuideState) -> Words:
    if state.mesh is not None:
        prompt.good(f"{state.mesh_file}, as before")
    else:
        path = prompt.path("Mesh of the object: OBJ, PLY, STL or GLB")
        try:
            state.mesh = load_mesh(path)
        except InputError as error:
            if error.code != "mesh-units":
                raise
            raise InputError(
                error.code,
                error.what,
                where=error.where,
                fix="Scale it in a 3D program (by 0.001 from millimetres, 0.01 from centimetres) and "
                "save it again.",
            ) from None
        state.mesh_file = path
        x, y, z = np.ptp(state.mesh.vertices, axis=0)
        prompt.good(
            f"{path.name} measures {100 * x:.0f} x {100 * y:.0f} x {100 * z:.0f} cm, "
            f"{len(state.mesh.faces):,} triangles"
        )
    return ["--object", str(state.mesh_file)]


MESH = GuideStep("The object", (), _ask_mesh, ("--object", "MESH"))


def _ask_scan(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("Mesh that the app made in that recording")
    scan = load_scan(path)
    x, y, z = np.ptp(scan.vertices, axis=0)
    prompt.good(
        f"{path.name} measures {x:.1f} x {y:.1f} x {z:.1f} m, {len(scan.faces):,} triangles"
    )
    return ["--scan", str(path)]


SCAN = GuideStep(
    "The scan",
    (
        "Export the mesh of that very recording as the app made it: not turned, not moved, not "
        "cropped to a new origin. The floor and other things may be in it.",
    ),
    _ask_scan,
    ("--scan", "SCAN"),
)


def _ask_colmap(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("COLMAP model: folder of cameras, images and points3D")
    model = read_model(path)
    prompt.good(f"{len(model.images):,} pictures, {len(model.points3D):,} points")
    return [str(path)]


COLMAP = GuideStep("The scan's model", (), _ask_colmap, ("MODEL",))


def _ask_model_pictures(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("Folder of its pictures, or COLMAP's database.db")
    if path.is_file():
        return ["--database", str(path)]
    count = sum(1 for file in path.rglob("*") if file.is_file())
    if not count:
        raise InputError("model-images", "There are no pictures.", where=str(path))
    prompt.good(f"{count:,} files")
    return ["--images", str(path)]


MODEL_PICTURES = GuideStep("Its pictures", (), _ask_model_pictures, ("--images", "PICTURES"))


def _ask_model_to_object(prompt: Prompt, state: GuideState) -> Words:
    if prompt.yes("Was the mesh made from that model, so that it has its frame?", default=True):
        return []
    path = prompt.path("File with the four rows of four that take the model into the mesh's frame")
    _, scale = load_similarity(path)
    prompt.good(f"it scales the model by {scale:.4g}")
    return ["--model-to-object", str(path)]


MODEL_TO_OBJECT = GuideStep(
    "The model and the mesh", (), _ask_model_to_object, ("--model-to-object", "MATRIX")
)
