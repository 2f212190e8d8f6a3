"""Commands that no other fast test calls end to end."""

import csv
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from capture_app.cli.app import invoke
from tests.capture_app.conftest import Inputs

QUICK = ("--samples", "1", "--steps", "2", "--no-video")


@pytest.mark.runs("run")
@pytest.mark.runs("export")
def test_a_result_is_exported(inputs: Inputs, weights: Path):
    given = ["--object", str(inputs.mesh), "--mount", str(inputs.mount), "--weights", str(weights)]
    assert invoke(["run", str(inputs.session), *given, "-o", str(inputs.output), *QUICK]) == 0
    for kind, size in (("glb", 1e5), ("bvh", 1e4), ("csv", 1e4)):
        file = inputs.folder / f"motion.{kind}"
        assert invoke(["export", str(inputs.output), "--to", kind, "-o", str(file)]) == 0
        assert file.stat().st_size > size


@pytest.mark.parametrize("said", [{}, {"output": ""}])
def test_an_export_without_a_format_says_how_to_name_one(tmp_path: Path, capsys, said: dict):
    where = ["-o", str(tmp_path)] if said else []
    assert invoke(["export", str(tmp_path), *where]) == 2
    assert "format-needed" in capsys.readouterr().err


@pytest.mark.runs("batch")
def test_a_batch_makes_what_can_be_made_and_says_what_cannot(inputs: Inputs, weights: Path, capsys):
    takes, out = inputs.folder / "takes", inputs.folder / "out"
    for name in ("one", "two"):
        (takes / name).mkdir(parents=True)
        (takes / name / "ARposes.txt").write_bytes((inputs.session / "ARposes.txt").read_bytes())
    given = ["--object", str(inputs.mesh), "--mount", str(inputs.mount), "--weights", str(weights)]
    words = ["batch", str(takes), *given, "-o", str(out), *QUICK[:-1], "--video-size", "160x120"]
    assert invoke(words) == 0
    assert "2 of 2" in capsys.readouterr().out
    for name in ("one", "two"):
        assert (out / name / "manifest.json").is_file()
        # Drawn by a job of its own, for which the batch waits.
        assert (out / name / "motion.mp4").is_file()
    (takes / "junk").mkdir()
    (takes / "junk" / "holiday.jpg").write_bytes(b"\xff\xd8")
    assert invoke(words) == 2
    with (out / "results.csv").open() as file:
        states = {row["name"]: (row["state"], row["code"]) for row in csv.DictReader(file)}
    assert states == {
        "one": ("done", ""),
        "two": ("done", ""),
        "junk": ("failed", "session-unknown"),
    }


@pytest.mark.runs("calibrate show")
def test_a_mount_is_shown(inputs: Inputs, capsys):
    assert invoke(["calibrate", "show", str(inputs.mount)]) == 0
    assert "made up" in capsys.readouterr().out


@pytest.mark.runs("worker", elsewhere=True)
def test_a_worker_joins_a_queue_and_leaves_when_told(tmp_path: Path):
    code = "from capture_app.cli.start import main; main()"
    arguments = [sys.executable, "-c", code, "worker", "--database", str(tmp_path / "jobs.sqlite")]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("Working for")
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0


@pytest.mark.runs("data build")
def test_training_clips_are_built_from_mocap(shared: Path, tmp_path: Path):
    root = shared / "data" / "mocap"
    source = min((root / "cmu_bvh").rglob("*.bvh"), key=lambda file: file.stat().st_size)
    copy = tmp_path / "mocap" / source.relative_to(root)
    copy.parent.mkdir(parents=True)
    copy.write_bytes(source.read_bytes())
    out = tmp_path / "clips.npz"
    assert invoke(["data", "build", str(tmp_path / "mocap"), "-o", str(out)]) == 0
    with np.load(out, allow_pickle=False) as file:
        assert len(file["index"].item()) > 10
