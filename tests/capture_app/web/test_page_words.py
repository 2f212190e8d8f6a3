"""Texts of the program as the page says them: labels in place of options."""

import ast
import pickle
import re
from pathlib import Path

import pytest

from capture_app.commands.spelling import in_options, labels
from capture_app.web.calibration_forms import FORMS, calibration_form
from capture_app.web.page_words import _BUTTONS, all_in_page_words, in_page_words
from capture_app.web.routes.about import choices
from omomo_core.errors import DamageError, InputError, in_own_words, reading

ROOT = Path(__file__).resolve().parents[3]
PAGE = "".join(path.read_text() for path in (ROOT / "capture_app" / "web" / "page").rglob("*.js"))
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
ROOMS = ("ingest", "omomo_core", "render")


@pytest.mark.parametrize("kind", ["", "run", "scan", "overlay", "export", "render", "calibrate"])
def test_every_label_stands_on_the_page(kind: str):
    described = {one["title"] for form in choices()["forms"].values() for one in form}
    for part in (part for key in FORMS for part in calibration_form(key)["parts"]):
        described |= {one["title"] for one in [*part["fields"], *part["more_fields"]]}
        described |= {part["title"], part["more"]}
    assert len(labels(kind)) > 30
    for field, label in labels(kind).items():
        assert label in PAGE or label in described, (
            f"{field} is called “{label}”, which the page does not say"
        )


def test_a_field_is_said_by_its_label():
    told = in_page_words("Leave out ‹floor›, give ‹floor› -0.80, or tick it (‹force›).")
    assert told == (
        "Leave out “Height of the floor”, give “Height of the floor” -0.80, or tick it "
        "(“Use a recording that is not usable”)."
    )
    assert in_page_words("Give ‹height›.", "scan") == "Give “Height of the object”."
    assert in_page_words("Give ‹height›.", "run") == "Give “Height of the person”."
    assert in_page_words("Leave the poses out (‹no poses›).", "scan").endswith("switched off).")
    assert in_page_words("Say ‹scanned_at› 3.") == "Say “scanned at” 3."
    assert in_page_words("5 -- 6, --x, a--b, {z}") == "5 -- 6, --x, a--b, {z}"
    assert all_in_page_words({"a": ["‹seed›", 1]}) == {"a": ["“Seed”", 1]}


def test_the_command_line_spells_fields_as_options():
    told = in_options(
        "Give ‹mesh_scale› 0.01, ‹unit›, ‹stills›, ‹place› or ‹no poses› with ‹output›."
    )
    assert told == "Give --mesh-scale 0.01, --units, --still, --board-place or --no-poses with -o."
    assert in_options("Use ‹omocap calibrate board-pdf›.") == "Use `omocap calibrate board-pdf`."
    error = InputError("code", "It is wrong.", field="mesh_scale")
    assert in_options(error.where) == "--mesh-scale"
    assert pickle.loads(pickle.dumps(error)).field == "mesh_scale"


def test_no_text_of_the_readers_is_in_the_dialect_of_the_command_line():
    for room in ROOMS:
        for path in (ROOT / room).rglob("*.py"):
            for call in ast.walk(ast.parse(path.read_text())):
                if isinstance(call, ast.keyword) and call.arg in ("what", "where", "fix"):
                    options = OPTION.findall(ast.unparse(call.value))
                    assert set(options) <= {"--flatten", "--unit"}, (path, options)


def test_a_command_is_said_by_its_button():
    assert in_page_words("Find it with ‹omocap calibrate› first.") == (
        "Find it with “Find it now, step by step” first."
    )
    assert in_page_words("Make it with ‹omocap calibrate scan ... -o MOUNT›.") == (
        "Make it with “Find it now, step by step”."
    )
    assert in_page_words("Try ‹omocap train›.") == "Try “omocap train”."
    for button in _BUTTONS.values():
        assert button in PAGE


@pytest.mark.parametrize(
    "problem",
    [
        KeyError("y"),
        TypeError("'NoneType' object is odd"),
        OSError(),
        ValueError("buffer is too small for requested array"),
    ],
)
def test_python_is_not_spoken(problem: Exception):
    assert in_own_words(problem) == "what it holds is not as its format has it"


def test_what_a_reader_finds_itself_is_said():
    with (
        pytest.raises(InputError, match="It is damaged: the header ends early"),
        reading(lambda why: InputError("odd", f"It is damaged: {why}.")),
    ):
        raise DamageError("the header ends early")
