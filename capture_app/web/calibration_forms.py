"""Forms of the ways to calibrate by recordings: steps of the guide, and fields as models describe them."""

from dataclasses import dataclass
from typing import Any

from capture_app.calibration.guide_flow import RECIPES
from capture_app.commands.calibrate import (
    BoardWay,
    FloorWay,
    ScanWay,
    SessionWay,
    TrackerWay,
    Way,
)
from capture_app.commands.inputs import FromLibrary, Inline, Matrix
from capture_app.web.described_forms import Described, form_of


@dataclass(frozen=True)
class FormPart:
    """A numbered part of a form."""

    title: str
    """That of the guide's step, whose instructions it shows."""
    fields: tuple[str, ...]
    text: tuple[str, ...] = ()
    """Instructions where the guide has no such step."""
    more: str = ""
    """Title behind which further fields are folded away."""
    more_fields: tuple[str, ...] = ()


@dataclass(frozen=True)
class FormOfWay:
    """A way to calibrate, as the page offers it."""

    model: type[Way]
    title: str
    hint: str
    """What it needs and gives, in a sentence or two."""
    name: str
    """Name of the mount, unless somebody changes it."""
    parts: tuple[FormPart, ...]
    looks: dict[str, str]
    """Which look is taken, by field, at what was brought, see `capture_app.web.sandboxed_work.Look`."""


_BOARD = FormPart("The board", ("board",))
_PLACE = FormPart("Where the board is on the object", ("place",))
_RECORD = FormPart("Record", ("session",))

FORMS = {
    "filmed": FormOfWay(
        SessionWay,
        "Board, and only the phone",
        "You need a printer. The phone films a printed board on the object, and is then clamped without "
        "stopping the log.",
        "Mount by board and phone",
        (_BOARD, _PLACE, _RECORD),
        {"session": "filmed"},
    ),
    "board": FormOfWay(
        BoardWay,
        "Board, and a second camera on a tripod",
        "The surest. You turn the object for 20 seconds: a few millimetres and tenths of a degree.",
        "Mount by board",
        (
            _BOARD,
            _PLACE,
            _RECORD,
            FormPart(
                "The film",
                ("film",),
                more="I know the second camera's numbers",
                more_fields=("camera",),
            ),
        ),
        {"session": "turned", "film": "film"},
    ),
    "meshed": FormOfWay(
        SessionWay,
        "The phone's own scan (LiDAR)",
        "Scan the object and clamp the phone in one recording; the app gives the mesh of it.",
        "Mount by scan and phone",
        (_RECORD, FormPart("The scan", ("scan",))),
        {"session": "rested"},
    ),
    "scan": FormOfWay(
        ScanWay,
        "The object's scan, found again",
        "The object was made from a film of it, and stands there still: two seconds at rest.",
        "Mount by scan",
        (
            _RECORD,
            FormPart(
                "The scan",
                (),
                (
                    "An object that was made here from a film brings its pictures along: nothing is to be "
                    "done.",
                ),
                "The object was scanned elsewhere",
                ("model", "model_to_object"),
            ),
        ),
        {"session": "still"},
    ),
    "tracker": FormOfWay(
        TrackerWay,
        "Motion capture, or a tracker on the object",
        "It follows the same motion as the phone.",
        "Mount by tracker",
        (
            _RECORD,
            FormPart(
                "The tracker's log",
                ("poses",),
                more="The tracked body does not have the mesh's frame",
                more_fields=("body",),
            ),
        ),
        {"session": "turned", "poses": "poses"},
    ),
    "floor": FormOfWay(
        FloorWay,
        "Make a mount surer by the floor",
        "From any recording in which the object stands on the floor.",
        "Mount, refined by the floor",
        (
            FormPart("The mount so far", ("mount",)),
            FormPart(
                "Record",
                ("session", "phone_height"),
                (
                    "Any recording with the phone clamped as before will do, in which the object stands on "
                    "the floor on a side of its own for two seconds; on several sides is better.",
                ),
            ),
        ),
        {},
    ),
}
"""Forms by the key of the guide's recipe, in the order of the page; the first is recommended."""


def calibration_form(key: str) -> dict[str, Any]:
    """Return the form of a way as the page builds it.

    Its parts have a title, `todo` (instructions), `fields`, and `more` with fields behind a title.
    A field is described as in `form_of`; what is brought is looked at as `look` says. Those of further kinds
    are "stored" (of the library's `shelves` alone), "board", "place", "camera" and "matrix".
    """
    form = FORMS[key]
    steps = {s.title: s.do for r in RECIPES if r.key == key for s in r.steps}
    fields = {one["name"]: one for one in form_of(form.model)}
    described = {name: _field(form, name, one) for name, one in fields.items()}
    return {
        "title": form.title,
        "hint": form.hint,
        "name": form.name,
        "method": fields["method"]["value"],
        "parts": [
            {
                "title": part.title,
                # Of the board's place the page shows the rest while its corners are clicked.
                "todo": part.text or steps.get(part.title, ())[: 1 if part is _PLACE else None],
                "fields": [described[name] for name in part.fields],
                "more": part.more,
                "more_fields": [described[name] for name in part.more_fields],
            }
            for part in form.parts
        ],
    }


def _field(form: FormOfWay, name: str, one: Described) -> Described:
    if name in ("board", "place", "camera"):
        return one | {"kind": name}
    marks = form.model.model_fields[name].metadata
    if any(isinstance(mark, Inline) and mark.value is Matrix for mark in marks):
        return one | {"kind": "matrix"}
    if any(isinstance(mark, FromLibrary) and mark.kinds == ("mount",) for mark in marks):
        return one | {"kind": "stored", "shelves": ("mount",)}
    return one | {"look": form.looks.get(name, "")}
