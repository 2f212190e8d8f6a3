"""The command line: what works says where it is, what cannot work says why in one paragraph."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from capture_app.cli.interrupts import STOPPED

# `inputs` writes the files of a good take: see conftest.py.
Inputs = Any


def arguments(
    inputs: Inputs, weights: Path, changed: dict[str, str | None] | None = None
) -> list[str]:
    options: dict[str, str | None] = {
        "object": str(inputs.mesh),
        "mount": str(inputs.mount),
        "output": str(inputs.output),
        "weights": str(weights),
        "samples": "1",
        "steps": "2",
        **(changed or {}),
    }
    words = [w for k, v in options.items() if v is not None for w in (f"--{k}", v)]
    return ["run", str(inputs.session), "--no-video", *words]


def assert_refused(
    capsys: pytest.CaptureFixture[str], folder: Path, words: list[str], code: str
) -> None:
    """Exit code 2, one paragraph with what, where, fix and code; nothing left behind."""
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*")}
    assert invoke(words) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert f"code: {code}" in printed.err
    assert printed.err.startswith("Error: ")
    assert "fix: " in printed.err
    assert "Traceback" not in printed.err
    assert "\n\n" not in printed.err
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*")} == before


def no_session(inputs: Inputs) -> None:
    (inputs.session / "ARposes.txt").unlink()
    inputs.session.rmdir()


def not_a_session(inputs: Inputs) -> None:
    (inputs.session / "ARposes.txt").rename(inputs.session / "holiday.txt")


def truncated_log(inputs: Inputs) -> None:
    log = inputs.session / "ARposes.txt"
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2 + 7])


def frozen_poses(inputs: Inputs) -> None:
    inputs.write_poses(np.zeros((181, 3)), Rotation.identity(181))


def lost_tracking(inputs: Inputs) -> None:
    """A jump every half second."""
    log = inputs.session / "ARposes.txt"
    poses = np.loadtxt(log, delimiter=",")
    poses[:, 1] += np.arange(len(poses)) // 30 % 2
    np.savetxt(log, poses, "%.6f", ",")


def nan_mesh(inputs: Inputs) -> None:
    text = inputs.mesh.read_text().splitlines()
    first = next(i for i, line in enumerate(text) if line.startswith("v "))
    text[first] = "v nan 0 0"
    inputs.mesh.write_text("\n".join(text))


def huge_mesh(inputs: Inputs) -> None:
    trimesh.creation.box((400.0, 500.0, 300.0)).export(inputs.mesh)


def sheared_mount(inputs: Inputs) -> None:
    T = np.eye(4)
    T[0, 1] = 0.3
    inputs.write_mount(T)


def mirrored_mount(inputs: Inputs) -> None:
    inputs.write_mount(np.diag([-1.0, 1.0, 1.0, 1.0]))


def no_mount_file(inputs: Inputs) -> None:
    inputs.mount.unlink()


def earlier_output(inputs: Inputs) -> None:
    inputs.output.mkdir()
    (inputs.output / "manifest.json").write_text("{}")


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (no_session, "session-missing"),
        (not_a_session, "session-unknown"),
        (truncated_log, "log-truncated"),
        (frozen_poses, "tracking-never-started"),
        (lost_tracking, "tracking-broken"),
        (nan_mesh, "mesh-not-finite"),
        (huge_mesh, "mesh-units"),
        (sheared_mount, "mount-not-rigid"),
        (mirrored_mount, "mount-not-rigid"),
        (no_mount_file, "mount-missing"),
        (earlier_output, "output-exists"),
    ],
)
def test_bad_input_is_refused(
    capsys: pytest.CaptureFixture[str],
    inputs: Inputs,
    weights: Path,
    spoil: Callable[[Inputs], None],
    code: str,
) -> None:
    spoil(inputs)
    assert_refused(capsys, inputs.folder, arguments(inputs, weights), code)


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"mount": None}, "mount-needed"),
        ({"weights": "nowhere"}, "weights-missing"),
        ({"config": "paper"}, "weights-configuration"),
        ({"body": "nowhere.npz"}, "body-missing"),
        ({"segment": "5"}, "segment-missing"),
        ({"up": "0,1"}, "direction-invalid"),
        ({"up": "0,0,0"}, "up-invalid"),
        ({"node": "chair"}, "node-unused"),
        ({"stood": "1"}, "place-invalid"),
        ({"stood": "nan,0"}, "place-invalid"),
        ({"stood": "40,0"}, "stood-far"),
        ({"ends": "40,0"}, "ends-far"),
        ({"side": "above"}, "place-invalid"),
        ({"side": "40,0"}, "side-far"),
    ],
)
def test_bad_options_are_refused(
    capsys: pytest.CaptureFixture[str],
    inputs: Inputs,
    weights: Path,
    changed: dict[str, str | None],
    code: str,
) -> None:
    assert_refused(capsys, inputs.folder, arguments(inputs, weights, changed), code)


def test_a_missing_recording_is_told_of_before_its_mount(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    words = arguments(inputs, weights, {"mount": None})
    words[1] = str(inputs.folder / "nowhere")
    assert_refused(capsys, inputs.folder, words, "session-missing")


def test_a_missing_mount_is_explained(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    invoke(arguments(inputs, weights, {"mount": None}))
    told = capsys.readouterr().err
    assert "with `omocap calibrate`" in told
    assert "--mount identity" in told
    assert "T_phone_object" not in told


@pytest.mark.runs("run")
def test_run_says_where_the_result_is_and_what_to_know(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    assert invoke(arguments(inputs, weights)) == 0
    told = capsys.readouterr().out
    assert str(inputs.output) in told
    assert "motion.glb" in told
    manifest = json.loads((inputs.output / "manifest.json").read_text())
    assert all(note in told for note in manifest["notes"])
    assert invoke([*arguments(inputs, weights), "--replace", "--seed", "4"]) == 0
    assert json.loads((inputs.output / "manifest.json").read_text())["options"]["seed"] == 4


@pytest.mark.runs("run")
@pytest.mark.runs("render")
def test_render_draws_a_result_again(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    assert invoke(arguments(inputs, weights)) == 0
    film, picture = inputs.folder / "film.mp4", inputs.folder / "still.png"
    small = ["render", str(inputs.output), "--size", "96x64"]
    assert invoke([*small, "-o", str(film)]) == 0
    assert invoke([*small, "-o", str(picture), "--still", "0.1"]) == 0
    assert invoke([*small, "-o", str(inputs.folder / "loop.webp")]) == 0
    assert film.stat().st_size > 1000
    assert (inputs.folder / "loop.webp").read_bytes()[8:12] == b"WEBP"
    assert picture.read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    for words, code in (
        (["--sample", "2"], "sample-missing"),
        (["--still", "60"], "time-outside"),
        (["--size", "big"], "size-invalid"),
        (["-o", str(inputs.folder / "no" / "film.mp4")], "output-not-writable"),
        (["-o", str(inputs.folder / "film.avi")], "output-ending"),
        (["--still", "0.1", "-o", str(inputs.folder / "still.jpg")], "output-ending"),
    ):
        assert_refused(capsys, inputs.folder, [*small, *words], code)
    assert_refused(capsys, inputs.folder, ["render", str(inputs.session)], "result-missing")


@pytest.mark.runs("run")
@pytest.mark.runs("render")
def test_no_marker_hides_the_hands_in_their_view(inputs: Inputs, weights: Path) -> None:
    assert invoke(arguments(inputs, weights)) == 0
    small = ["render", str(inputs.output), "--size", "96x64", "--still", "0.1"]
    pictures: list[bytes] = []
    for words in ([], ["--no-markers"], ["--view", "hands"], ["--view", "hands", "--no-markers"]):
        picture = inputs.folder / f"{len(pictures)}.png"
        assert invoke([*small, *words, "-o", str(picture)]) == 0
        pictures.append(picture.read_bytes())
    assert pictures[0] != pictures[1]
    assert pictures[2] == pictures[3] != pictures[0]


@pytest.mark.runs("rerun")
def test_rerun_makes_the_same_motion(inputs: Inputs, weights: Path) -> None:
    assert invoke(arguments(inputs, weights)) == 0
    again = inputs.folder / "again"
    assert invoke(["rerun", str(inputs.output), "-o", str(again)]) == 0
    first = (inputs.output / "motion.npz").read_bytes()
    assert (again / "motion.npz").read_bytes() == first


@pytest.mark.runs("inspect")
def test_inspect_reports_a_good_take(capsys: pytest.CaptureFixture[str], inputs: Inputs) -> None:
    words = ["inspect", str(inputs.session), "--object", str(inputs.mesh)]
    assert_refused(capsys, inputs.folder, words, "mount-needed")
    words += ["--mount", "identity"]
    assert invoke(words) == 0
    told = capsys.readouterr().out
    assert "Segment 1: 0.0 to 3.0 s" in told
    assert "Floor: " in told
    assert invoke([*words, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["usable"]
    assert report["segments"] == [[0, 91]]
    assert {"name", "severity", "message", "frames", "fix"} == set(report["checks"][0])


def test_inspect_of_an_unusable_take(capsys: pytest.CaptureFixture[str], inputs: Inputs) -> None:
    lost_tracking(inputs)
    assert invoke(["inspect", str(inputs.session)]) == 2
    printed = capsys.readouterr()
    assert "tracking jump" in printed.out
    assert "code: tracking-broken" in printed.err
    assert invoke(["inspect", str(inputs.session), "--json"]) == 2
    report = json.loads(capsys.readouterr().out)
    assert not report["usable"]
    assert "tracking-broken" in report["problem"]


@pytest.mark.runs("doctor")
def test_doctor_names_every_part(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["doctor"]) in (0, 2)
    told = capsys.readouterr().out
    for part in ("omocap", "packages", "body", "weights", "OpenGL", "video encoder", "memory"):
        assert part in told


def test_paths_with_brackets_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["inspect", "/takes/[red]chair[/]"]) == 2
    assert "/takes/[red]chair[/]" in capsys.readouterr().err


def test_usage_errors_exit_with_two(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["run"]) == 2
    assert invoke(["dance"]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_defect_is_one_line_unless_debugging(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(path: Path, app: str | None) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("capture_app.inspection.read_session", broken)
    assert invoke(["inspect", "take"]) == 1
    told = capsys.readouterr().err
    assert "ZeroDivisionError" in told
    assert "--debug" in told
    with pytest.raises(ZeroDivisionError):
        invoke(["inspect", "take", "--debug"])


def test_an_interrupt_is_quiet(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(path: Path, app: str | None) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("capture_app.inspection.read_session", interrupted)
    assert invoke(["inspect", "take"]) == 130
    assert capsys.readouterr().err == f"{STOPPED}\n"


def test_the_help_shows_no_type_beside_a_flag(capsys: pytest.CaptureFixture[str]):
    for words in ((), ("run",), ("calibrate",), ("calibrate", "points"), ("inspect",)):
        assert invoke([*words, "--help"]) == 0
        told = capsys.readouterr().out
        assert "--help" in told
        assert "-h " in told
        assert "bool" not in told


def test_help_loads_nothing_heavy() -> None:
    look = (
        "import sys; from capture_app.cli.app import invoke; assert invoke(['run', '--help']) == 0;"
        "heavy = {'torch', 'scipy', 'trimesh', 'pyrender', 'av', 'numpy', 'sqlalchemy', 'dbos'};"
        "heavy &= set(sys.modules);"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", look], capture_output=True, text=True, env=os.environ, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "--mount" in done.stdout


def test_a_run_loads_no_statistics_and_no_signal_processing(tmp_path: Path) -> None:
    """Both take half a second of every start."""
    demo = "capture_app/demo_take"
    said = [
        "run",
        f"{demo}/session",
        "--object",
        f"{demo}/box.obj",
        "--mount",
        f"{demo}/mount.json",
    ]
    said += ["-o", str(tmp_path / "out"), "--samples", "1", "--steps", "2", "--no-video"]
    look = (
        f"import sys; from capture_app.cli.app import invoke; assert invoke({said}) == 0;"
        "heavy = {'scipy.stats', 'scipy.signal'} & set(sys.modules);"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_server_starts_without_what_its_workers_load() -> None:
    look = (
        "import sys; import capture_app.web.server; heavy = {'torch', 'pyrender'} & set(sys.modules);"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
