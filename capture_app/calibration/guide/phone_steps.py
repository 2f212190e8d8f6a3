"""Steps about the phone itself: its model, its place by points, and its place by a drawing."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from capture_app.calibration.guide.finding import Finding
from capture_app.calibration.guide.placement import astray
from capture_app.calibration.guide.prompt import Prompt, as_path
from capture_app.calibration.guide.steps import AgainError, GuideState, GuideStep, Words
from ingest.calibration.drawing import MEASURED, PRINTED, numbers, rotation_in_words
from ingest.calibration.phone_body import body_point, phone_named
from ingest.calibration.picked_points import MAX_OFFSET, mount_from_pairs
from ingest.calibration.points import PointPair, load_pairs, save_pairs
from omomo_core.errors import InputError

AXES = (
    "Numbers are x y z in metres in the mesh's own frame, as a 3D program shows it. Blender turns an "
    "OBJ on import unless you choose Y forward and Z up; a GLB is read as Blender shows it (z up)."
)
_PRECISIONS = (
    ("printed or milled after the drawing", PRINTED),
    ("measured with a ruler and by eye", MEASURED),
)
ENOUGH = 3
"""Points that give a mount."""
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
_HELD_OFF = 0.3
"""Metres from the surface to a phone in a clamp, at most."""


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
    found = _typed_points(prompt)
    path = found if isinstance(found, Path) else _kept(prompt, state, found)
    if not prompt.accept(_check_pairs(load_pairs(path), state)):
        raise AgainError
    return [str(path)]


def _kept(prompt: Prompt, state: GuideState, pairs: Sequence[PointPair]) -> Path:
    """What was typed is written before it is judged, so that a wrong number can be mended."""
    path = state.fresh("points.json")
    save_pairs(pairs, path)
    prompt.tell(f"Kept in {path}.")
    return path


def _typed_points(prompt: Prompt) -> Path | list[PointPair]:
    """As many as the person knows, of the points that have names; or a file."""
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
    picked = mount_from_pairs(pairs, state.model)
    names, places = [pair.name for pair in pairs], np.array([pair.object for pair in pairs])
    doubts = astray(state.object_mesh, names, places, _HELD_OFF)
    notes = (picked.mount.note,) if picked.mount.note else ()
    if picked.fit.loose or not picked.fit.kept.all():
        doubts, notes = doubts + notes, ()
    if len(pairs) == ENOUGH:
        notes += ("Three points fit nearly always: a fourth would show a mistake.",)
    rms, worst = picked.mount.residuals["rms_mm"], picked.mount.residuals["worst_mm"]
    return Finding(
        f"{len(pairs)} points, which fit the phone within {rms:.1f} mm (worst {worst:.1f})",
        doubts,
        notes,
    )


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
    off = astray(state.object_mesh, [point], place[None], _HELD_OFF)
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
