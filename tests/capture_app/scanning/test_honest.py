"""A scan says the worst first: what was filmed from one side is no object, and has no size."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from capture_app.cli.app import invoke
from capture_app.cli.scan import _show
from capture_app.inspection import Inspection, inspect_take, usable_take
from capture_app.scanning.scan_report import report_data, scan_page
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from ingest.report.take_report import Check
from ingest.scan.scan_quality import ScanReport, coverage_of, cut_off, inspect_scan
from ingest.scan.scan_types import Scale
from ingest.scan.scanned_object import to_height
from omomo_core.errors import InputError
from tests.capture_app.scanning.filmed import film_small


def _one_side(found, degrees: float = 170):
    around = coverage_of(found).azimuth
    views = found.registered.views
    half = tuple(v for v, a in zip(views, around, strict=True) if a < degrees)
    return replace(found, registered=replace(found.registered, views=half))


def _scale(found) -> Check:
    return next(check for check in inspect_scan(found).checks if check.name == "scale")


def test_a_film_of_one_side_is_not_usable(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """The command itself: what it closed with a guess is no object, and nothing says it were."""
    film = film_small(tmp_path / "film", arc=100.0)
    words = ["scan", str(film.path), "-o", str(tmp_path / "box.glb"), "--vertices", "1000"]
    assert invoke([*words, "--draft", "--method", "depth"]) == 2
    said = " ".join(capsys.readouterr().out.split())
    assert said.startswith("Not usable as it is: the film does not show the whole object;")
    for comfort in ("Done", "Next", "sure to"):
        assert comfort not in said
    report = json.loads((tmp_path / "box.scan" / "report.json").read_text())
    assert (report["usable"], report["scale"]["sigma"]) == (False, None)
    assert (tmp_path / "box.glb").is_file()
    page = (tmp_path / "box.scan" / "report.html").read_text()
    assert "This scan is not usable as it is" in page
    assert "<dt>Size is sure to</dt><dd>nothing</dd>" in page


def test_a_film_from_all_around_is_done(scanned, capsys: pytest.CaptureFixture[str]):
    assert scanned.scan.report.usable
    _show(scanned.scan)
    said = " ".join(capsys.readouterr().out.split())
    assert "Done: in" in said
    assert "Next: omocap calibrate scan" in said
    assert "Not usable" not in said
    assert "sure to" in _scale(scanned.scan.found).message
    scan, found = scanned.scan, scanned.scan.found
    report = report_data(scan.request, found.cleaned, scan.report, found, {})
    assert report["usable"] is True
    assert report["scale"]["sigma"] == pytest.approx(found.registered.scale.sigma)


def test_a_height_given_to_a_part_is_the_parts(scanned):
    """What is not known is said, whichever way the metre came."""
    found = scanned.scan.found
    scale = Scale(0.5, "height", "the object's height")
    guessed = replace(found, registered=replace(found.registered, scale=scale))
    whole, part = _scale(to_height(guessed, 0.9)), _scale(_one_side(to_height(guessed, 0.9)))
    assert "sure to" in whole.message
    assert part.severity == "bad"
    assert "The height of 0.90 m was given to what was filmed" in part.message
    assert "sure to" not in _scale(_one_side(found)).message


@pytest.mark.parametrize(("degrees", "usable"), [(200, False), (240, True)])
def test_how_much_of_the_circle_is_needed(scanned, degrees: float, usable: bool):
    """A gap of up to 150 degrees has limits, a wider one is a side that was not filmed."""
    report = inspect_scan(_one_side(scanned.scan.found, degrees))
    assert report.usable is usable
    assert report.cut_off is not usable
    words = "usable with limits" if usable else "not usable as it is"
    page = scan_page(scanned.scan.request, scanned.scan.cleaned, report, scanned.scan.found, {})
    assert f"This scan is {words}" in page


@pytest.mark.parametrize(("name", "cut"), [("unseen", True), ("all around", True), ("size", False)])
def test_what_cuts_an_object_off(name: str, cut: bool):
    assert cut_off([Check(name, "bad", "")]) is cut
    assert not cut_off([Check(name, "warn", "")])
    assert not ScanReport((Check(name, "bad", ""),), None).usable
    assert ScanReport((Check(name, "warn", ""),), None).usable


def test_a_run_refuses_the_mesh_of_a_scan_that_is_not_usable(tmp_path: Path):
    """The verdict goes with the mesh; without its report the mesh is judged by itself."""
    shutil.copytree(DEMO, tmp_path / "take")
    mesh, report = tmp_path / "take" / MESH, tmp_path / "take" / Path(MESH).stem
    checks = [{"name": "unseen", "severity": "bad"}, {"name": "colour", "severity": "warn"}]
    verdict = {"mesh": Path(MESH).name, "usable": False, "checks": checks}
    folder = report.with_suffix(".scan")
    folder.mkdir()

    def seen(**said: object) -> Inspection:
        (folder / "report.json").write_text(json.dumps(verdict | said))
        return inspect_take(tmp_path / "take" / SESSION, mesh, tmp_path / "take" / MOUNT)

    found = seen()
    assert found.verdict == "not usable"
    assert found.reason == f"scan: omocap scan found its mesh {mesh.name} not usable: unseen"
    with pytest.raises(InputError, match=r"report\.html"):
        usable_take(found)
    assert usable_take(found, force=True) is found.take
    words = [
        str(tmp_path / "take" / SESSION),
        "--object",
        str(mesh),
        "-o",
        str(tmp_path / "motion"),
    ]
    assert invoke(["run", *words, "--mount", str(tmp_path / "take" / MOUNT)]) == 2
    assert not (tmp_path / "motion").exists()
    for other in ({"usable": True}, {"mesh": "other.obj"}, {"checks": None}):
        assert seen(**other).verdict != "not usable"


@pytest.mark.slow
def test_a_real_film_of_one_side(shared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """A chair that somebody filmed from 138 degrees of the circle."""
    film = shared / "data" / "scan" / "chair_3d_scanner_app"
    mesh = str(tmp_path / "chair.glb")
    assert invoke(["scan", str(film), "-o", mesh, "--method", "depth", "--symmetry", "off"]) == 2
    said = " ".join(capsys.readouterr().out.split())
    assert said.startswith("Not usable as it is: the film does not show the whole object;")
    missing = re.search(r"from (\d+) degrees of the circle", said)
    assert missing is not None, said
    assert 210 <= int(missing[1]) <= 230, said
    for comfort in ("Done", "Next", "sure to"):
        assert comfort not in said
