"""`omocap calibrate` without a method: a person answers, and a mount comes out."""

import builtins
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import typer

from capture_app.calibration.guide_flow import RECIPES, Wizard
from capture_app.calibration.guide_phone_steps import POINTS
from capture_app.calibration.guide_steps import GuideState, Prompt, Recipe
from capture_app.cli.app import invoke
from capture_app.cli.calibrate.app import app as calibrate
from capture_app.cli.console import output
from capture_app.simulator.demo_take import clamped_phone, record_demo
from ingest.calibration.phone_body import body_point, phone_body
from ingest.mount_file import load_mount, save_mount
from omomo_core.geometry.transforms import inverse
from tests.capture_app.calibrate.guided import (
    BY_DRAWING,
    BY_POINTS,
    DRAWING,
    PHONE,
    drawn,
    numbers,
    off,
)


@pytest.mark.runs("calibrate drawing")
def test_a_drawing_by_answers(converse, tmp_path: Path):
    told = converse(*DRAWING, "")
    assert told.code == 0, told.err
    assert off(load_mount(tmp_path / "mount.json"), clamped_phone()) < (0.1, 0.01)
    assert "screen faces -x" in told.out
    assert "omocap run RECORDING --object box.obj --mount mount.json" in told.out


def test_the_command_that_is_printed_gives_the_same_mount(converse, tmp_path: Path):
    told = converse(*DRAWING, "")
    words = told.commands[0]
    assert words[-2:] == ["-o", "mount.json"]
    assert invoke(["calibrate", *words[:-1], "again.json"]) == 0
    first, again = (load_mount(tmp_path / name) for name in ("mount.json", "again.json"))
    np.testing.assert_array_equal(first.T_phone_object, again.T_phone_object)


@pytest.mark.parametrize("count", range(len(DRAWING) + 1))
def test_answers_that_end_say_how_to_go_on(converse, tmp_path: Path, count: int):
    told = converse(*DRAWING[:count])
    assert told.code == 2
    assert "guide-ended" in told.err
    assert "omocap calibrate" in told.err
    done = count >= len(DRAWING) - 1  # before the last one there is a mount, not yet looked at
    assert ("floor mount.json RECORDING" in told.err) == (count == len(DRAWING))
    assert (tmp_path / "mount.json").exists() == done
    if not done:
        assert [path.name for path in tmp_path.iterdir()] == ["box.obj"]
    if 4 <= count < len(DRAWING) - 1:
        assert "omocap calibrate drawing --object box.obj --phone 'iPhone 15' --xyz" in told.err
    if count == len(DRAWING) - 1:
        assert "omocap calibrate show mount.json" in told.err


def test_interrupted_it_says_how_to_go_on(converse, monkeypatch: pytest.MonkeyPatch, capsys):
    answers = iter(DRAWING[:4])

    def asked(prompt: str = "") -> str:
        try:
            return next(answers)
        except StopIteration:
            raise KeyboardInterrupt from None

    monkeypatch.setattr(builtins, "input", asked)
    assert invoke(["calibrate"]) == 130
    printed = capsys.readouterr().out
    assert "omocap calibrate drawing --object box.obj --phone 'iPhone 15' --xyz" in printed


def test_wrong_answers_are_asked_again(converse, tmp_path: Path):
    save_mount(clamped_phone(), tmp_path / "old.json")
    (tmp_path / "far.obj").write_text("v 0 0 0\nv 300 0 0\nv 0 400 0\nf 1 2 3\n")
    model, point, xyz, axes, precision = drawn(clamped_phone())
    told = converse(
        *("99", "none", BY_DRAWING),
        *("old.json", "nowhere/mount.json", "mount.json"),
        *("missing.obj", "far.obj", "box.obj"),
        *("Nokia", "", model),
        *("nose", point, "1 2", point, "200 50 60", point, xyz),
        *("screen faces up", axes, "7", precision, "y", ""),
    )
    assert told.code == 0, told.err
    assert off(load_mount(tmp_path / "mount.json"), clamped_phone()) < (0.1, 0.01)
    for hint in (
        "Answer with a number from 1 to 7",
        "There is already a file of that name",
        "The folder for the file is not there",
        "There is no such mesh file",
        "by 0.001 from millimetres",
        "The sizes of 'Nokia' are not known",
        "'nose' names no point of a phone",
        "'1 2' is not 3 numbers",
        "120 mm are 0.12",
        "'screenfacesup' is not understood",
    ):
        assert hint in told.out


def test_a_mount_that_is_not_believed_is_taken_away(converse, tmp_path: Path):
    """The sign of one axis is wrong; the person sees it in the words."""
    model, point, xyz, axes, precision = drawn(clamped_phone())
    wrong = "-" + xyz
    told = converse(
        *(BY_DRAWING, "mount.json", "box.obj", model, point, wrong, axes, precision, "n"),
        *("3", point, xyz, "y", ""),
    )
    assert told.code == 0, told.err
    assert "on the object's -x side" in told.out
    assert "mount.json is taken away again" in told.out
    assert off(load_mount(tmp_path / "mount.json"), clamped_phone()) < (0.1, 0.01)


def corners(wrong: float = 0.0) -> dict[str, str]:
    """Four points of the phone on the object, the last one moved by metres."""
    T = inverse(clamped_phone().T_phone_object) @ phone_body(PHONE)[0]
    names = ("top left back corner", "top right back corner", "bottom left back corner", "lens")
    places = {name: (T @ [*body_point(PHONE, name), 1])[:3] for name in names}
    places["lens"] = places["lens"] + [wrong, 0, 0]
    return {name: numbers(place) for name, place in places.items()}


def point_answers(known: dict[str, str]) -> list[str]:
    """In the order in which the guide asks for them; nothing for those that are not known."""
    return [known.get(name, "") for name in POINTS]


@pytest.mark.runs("calibrate guide")
@pytest.mark.runs("calibrate points")
def test_points_by_answers(converse, tmp_path: Path):
    answers = point_answers(corners())
    told = converse(
        *(BY_POINTS, "mount.json", "box.obj", "iphone 15", "n"),
        *("0.1 0.2", *answers[:3], "", *answers[4:], "y", ""),
    )
    assert told.code == 0, told.err
    assert "4 points, which fit the phone within 0.0 mm" in told.out
    assert off(load_mount(tmp_path / "mount.json"), clamped_phone()) < (0.1, 0.05)
    assert len(json.loads((tmp_path / "points.json").read_text())["pairs"]) == 4


def test_a_point_that_is_off_is_named_and_mended_in_the_file(converse, tmp_path: Path):
    kept = tmp_path / "points.json"
    far = point_answers(corners(wrong=0.05))
    told = converse(BY_POINTS, "mount.json", "box.obj", "iPhone 15", "n", *far)
    assert "guide-ended" in told.err
    assert not (tmp_path / "mount.json").exists()
    assert "But: " in told.out or "No: " in told.out
    file = json.loads(kept.read_text())
    file["pairs"][-1]["object"] = [float(x) for x in corners()["lens"].split()]
    kept.write_text(json.dumps(file))
    told = converse(BY_POINTS, "mount.json", "box.obj", "iPhone 15", "n", "points.json", "y", "")
    assert told.code == 0, told.err
    assert "points.json" in told.commands[0]
    assert not (tmp_path / "points-2.json").exists()


@pytest.mark.runs("calibrate floor")
def test_the_floor_refines_a_drawing(converse, tmp_path: Path):
    record_demo(tmp_path / "demo", video=False)
    told = converse(*DRAWING, "nothing", "demo/session", "y", "high", "")
    assert told.code == 0, told.err
    assert "There is no such file or folder" in told.out
    assert "rests on the floor 2 times" in told.out
    assert told.commands[1][:3] == ["floor", "mount.json", "demo/session"]
    found = load_mount(tmp_path / "mount-floor.json")
    assert found.method == "drawing, refined by the floor"
    assert "--mount mount-floor.json" in told.out


def test_a_floor_that_contradicts_leaves_the_mount(converse, tmp_path: Path):
    record_demo(tmp_path / "demo", video=False)
    told = converse(*DRAWING, "demo/session", "y", "0.9")
    assert told.code == 0, told.err
    assert "mount.json stays as it is" in told.out
    assert "--mount mount.json" in told.out
    assert not (tmp_path / "mount-floor.json").exists()


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.have)
def test_every_command_line_is_one(recipe: Recipe, tmp_path: Path):
    """Those with capitals, too: who fills them in by hand meets no unknown option."""

    def run(words: Sequence[str]) -> None:
        raise AssertionError(words)

    walk = Wizard(recipe, tmp_path / "mount.json", Prompt(output), GuideState(tmp_path, run))
    method, *words = walk.words
    group = typer.main.get_command(calibrate)
    command = group.commands[method]  # pyright: ignore[reportAttributeAccessIssue]
    with command.make_context(method, words) as context:
        assert context.params["mount_file" if "mount_file" in context.params else "file"]
