"""Texts of the program as the page says them: labels in place of options."""

import re
from pathlib import Path

import pytest

from capture_app.web.page_words import _BUTTONS, _labels, all_in_page_words, in_page_words
from omomo_core.errors import reader_complaint

ROOT = Path(__file__).resolve().parents[3]
PAGE = "".join(path.read_text() for path in (ROOT / "capture_app" / "web" / "page").rglob("*.js"))
OPTION = re.compile(r"--[a-z][a-z-]+")


@pytest.mark.parametrize("kind", ["", "run", "scan", "overlay", "export", "render", "calibrate"])
def test_every_label_stands_on_the_page(kind: str):
    labels = _labels(kind)
    assert len(labels) > 30
    for option, label in labels.items():
        assert label in PAGE, f"{option} is called “{label}”, which the page does not say"


def test_an_option_is_said_by_its_label():
    told = in_page_words("Leave out --floor, give --floor -0.80, or tick it (--force).")
    assert told == (
        "Leave out “Height of the floor”, give “Height of the floor” -0.80, or tick it "
        "(“Use a recording that is not usable”)."
    )
    assert in_page_words("Give --height.", "scan") == "Give “Height of the object”."
    assert in_page_words("Give --height.", "run") == "Give “Height of the person”."
    assert in_page_words("Leave the poses out (--no-poses).", "scan").endswith("switched off).")
    assert in_page_words("Say --scanned-at 3.") == "Say “scanned at” 3."
    assert in_page_words("5 -- 6, a--b, -z") == "5 -- 6, a--b, -z"
    assert all_in_page_words({"a": ["--seed", 1]}) == {"a": ["“Seed”", 1]}


def test_no_text_of_the_readers_keeps_an_option():
    sources = [path.read_text() for path in (ROOT / "ingest").rglob("*.py")]
    for option in {found for text in sources for found in OPTION.findall(text)}:
        assert "--" not in in_page_words(f"Give {option} a value.")


def test_a_command_is_said_by_its_button():
    assert in_page_words("Find it with `omocap calibrate` first.") == (
        "Find it with “Find it now, step by step” first."
    )
    assert in_page_words("Make it with `omocap calibrate screen ... --learn MOUNT`.") == (
        "Make it with “Find it now, step by step”."
    )
    assert in_page_words("Try `omocap train`.") == "Try “omocap train”."
    for button in _BUTTONS.values():
        assert button in PAGE


@pytest.mark.parametrize(
    "problem", [KeyError("y"), TypeError("'NoneType' object is odd"), OSError()]
)
def test_python_is_not_spoken(problem: Exception):
    assert reader_complaint(problem) == "what it holds is not as its format has it"
    assert reader_complaint(ValueError("PLY header ends early")) == "PLY header ends early"
