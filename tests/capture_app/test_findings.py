"""What `omocap inspect` finds amber is said by a run, kept in its manifest, and refused by --strict."""

import csv
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from capture_app.cli.app import invoke
from capture_app.inspection import findings, inspect_take
from capture_app.manifest import MANIFEST, read_manifest, to_look_at
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from tests.capture_app.conftest import FAST, Inputs


@pytest.fixture
def far(inputs: Inputs) -> Inputs:
    """The phone is 15 cm farther from the box than it may be without an arm."""
    T = np.eye(4)
    T[1, 3] = -0.15
    inputs.write_mount(T)
    return inputs


def _words(inputs: Inputs, weights: Path, *more: str) -> list[str]:
    options = [word for name, value in FAST.items() for word in (f"--{name}", str(value))]
    files = ["--object", inputs.mesh, "--mount", inputs.mount, "-o", inputs.output]
    return ["run", *map(str, (inputs.session, *files)), "--weights", str(weights), "--no-video",
            *options, *more]  # fmt: skip


def test_a_run_says_what_inspect_says(far: Inputs, weights: Path, capsys) -> None:
    found = findings(inspect_take(far.session, far.mesh, far.mount))
    assert "phone on the object" in [one.name for one in found]
    assert invoke(_words(far, weights)) == 0
    out = " ".join(capsys.readouterr().out.split())
    manifest = read_manifest(far.output / MANIFEST)
    assert manifest.findings == found
    for one in found:
        assert one.message in out
    assert out.endswith(f"Done, but look at: {', '.join(to_look_at(manifest))}")


def test_a_strict_run_refuses_it(far: Inputs, weights: Path, capsys) -> None:
    assert invoke(_words(far, weights, "--strict")) == 2
    told = capsys.readouterr().err
    assert "code: take-limited" in told
    assert "which takes an arm" in told
    assert "leave out --strict" in told
    assert not far.output.exists()


def test_a_strict_batch_refuses_it_and_makes_the_others(far: Inputs, weights: Path, capsys) -> None:
    good = (DEMO / SESSION, DEMO / MESH, DEMO / MOUNT, "good")
    table, out = far.folder / "takes.csv", far.folder / "out"
    takes = [good, (far.session, far.mesh, far.mount, "far")]
    lines = [",".join(map(str, take)) for take in takes]
    table.write_text("\n".join(["session,object,mount,name", *lines, ""]))
    options = [word for name, value in FAST.items() for word in (f"--{name}", str(value))]
    words = ["batch", table, "-o", out, "--weights", weights, "--no-video", "--strict", *options]
    assert invoke([str(word) for word in words]) == 2
    told = " ".join(capsys.readouterr().out.split())
    assert "Done: 1 of 2" in told
    assert "usable with limits" in told
    with (out / "results.csv").open() as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert {name: (row["state"], row["code"]) for name, row in rows.items()} == {
        "good": ("done", ""),
        "far": ("failed", "take-limited"),
    }
    assert (out / "good" / MANIFEST).is_file()
    assert not (out / "far").exists()


def test_the_phone_on_the_object_is_drawn(far: Inputs, tmp_path: Path, capsys) -> None:
    picture, page = tmp_path / "take.png", tmp_path / "take.html"
    files = ["--object", str(far.mesh), "--mount", str(far.mount)]
    words = ["inspect", str(far.session), "--picture", str(picture), "--html", str(page)]
    assert invoke([*words, *files]) == 0
    with Image.open(picture) as drawn:
        assert drawn.size == (3 * 420 + 2 * 4, 420)
    assert "data:image/jpeg;base64," in page.read_text()
    assert invoke(words) == 2
    assert "code: picture-none" in capsys.readouterr().err
