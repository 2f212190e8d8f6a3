"""What is said of a mount is said in the same sentences by the command line, the API and the page."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from capture_app.calibration.mount_words import fit_sentence, mount_words
from capture_app.cli.app import app
from capture_app.simulator.demo_take import DEMO, MOUNT
from ingest.mount_file import load_mount, save_mount
from ingest.uncertainty import ConfidenceRadii

BOUNDS = ConfidenceRadii(2.34, 0.05)


def test_a_mount_tells_its_way_and_its_bounds():
    told = mount_words("board", BOUNDS, {"rms_mm": 3.21, "clock offset_s": 12.5})
    assert told["found"] == "by a board and a second camera, within 2.3 mm and 0.05°"
    place, turn, both, fit = told["sure"]
    assert place == "The phone's place on the object is sure to ± 2.3 mm; hands need ± 20 mm."
    assert turn == "Its direction is sure to ± 0.05°; hands need ± 3°."
    assert "95 times of 100" in both
    assert fit == "What was measured fits to 3.2 mm on average; a good fit is under 5 mm."
    assert told["warnings"] == []


def test_what_is_not_known_is_said():
    assert mount_words("identity", None, {})["found"] == "taken as the phone itself"
    told = mount_words("points", None, {})
    assert told["found"] == "by points on phone and object, error unknown"
    assert told["sure"] == ["How sure it is is not known."]


@pytest.mark.parametrize("bounds", [ConfidenceRadii(20.1, 1.0), ConfidenceRadii(5.0, 3.1)])
def test_a_mount_that_may_put_hands_off_the_object_warns(bounds):
    [warning] = mount_words("drawing", bounds, {})["warnings"]
    assert "hands may be that far off the object" in warning


def test_a_residual_is_a_sentence_with_what_a_good_one_is():
    good = "Its directions fit to 0.4° on average; a good fit is under 1°."
    assert fit_sentence("rms_deg", 0.4) == good
    assert fit_sentence("moments used_%", 97.3) == "97 % of the recording were used."
    assert fit_sentence("inliers", 812.0) == "812 points were found again."
    assert fit_sentence("clock offset_s", 12.5) == ""


@pytest.mark.parametrize(
    ("value", "told"), [(0.043, "0.04"), (0.1, "0.1"), (4.26, "4.3"), (10.4, "10"), (123.4, "123")]
)
def test_numbers_have_decimals_where_these_say_something(value, told):
    assert fit_sentence("rms_mm", value).startswith(f"What was measured fits to {told} mm ")


def test_the_command_line_says_the_same(tmp_path):
    mount = replace(load_mount(DEMO / MOUNT), method="points", residuals={"rms_mm": 3.21})
    save_mount(mount, tmp_path / "mount.json")
    result = CliRunner().invoke(app, ["calibrate", "show", str(tmp_path / "mount.json")])
    printed = " ".join(result.output.split())
    assert fit_sentence("rms_mm", 3.21) in printed
