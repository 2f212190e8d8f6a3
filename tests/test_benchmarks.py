"""Benchmarks are no tests, but they must start: each is loaded, and those of hands measure the demo."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from benchmarks import hand_cost, hands, mesh_readers
from benchmarks.scan_errors import HEAD, compared
from ingest.scan.clean_mesh import clean
from ingest.scan.scan_types import Region
from tests.simulator.scan_film import ScanFilm, around
from tests.simulator.scan_scene import scan_scene

NAMES = sorted(path.stem for path in Path(hands.__file__).parent.glob("*.py"))


def test_benchmarks_can_be_loaded() -> None:
    """In a process of their own, as they are run."""
    code = "".join(f"import benchmarks.{name}\n" for name in NAMES if name != "__init__")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_hands_of_the_demo_are_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["hands", "--only", "demo", "--pictures", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    hands.main()
    head, demo, *_ = capsys.readouterr().out.splitlines()
    assert head.split()[0] == "object"
    finger, deepest = (float(word) for word in demo.split()[1:3])
    assert finger <= 2 <= deepest <= 8
    assert (tmp_path / "demo.png").exists()


def test_what_hands_of_the_demo_cost_is_measured() -> None:
    spent, whole = hand_cost.cost(None)
    assert 0 < spent < 0.5 * whole


def test_the_drift_of_a_phone_is_told_from_the_error_of_a_mesh() -> None:
    scene = scan_scene(11, "box")
    film = ScanFilm(scene, Path(), around(scene, 12), np.eye(4), 960)
    drift = np.eye(4)
    drift[:3, 3] = 0.004, 0.0, 0.0
    T = drift @ scene.T_world_object
    vertices = scene.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    region = Region(np.eye(4), vertices.min(axis=0) - 0.1, vertices.max(axis=0) + 0.1)
    faces, seen = np.asarray(scene.mesh.faces), np.ones(len(vertices), bool)
    mesh = clean(vertices, faces, None, region, "box", seen=seen)
    row = dict(zip(HEAD.split()[7:10], compared(mesh, film, drift).split()[:3], strict=True))
    assert float(row["median"]) < 0.1
    assert float(row["p90"]) < 0.1
    assert float(row["world"]) > 0.5


def test_readers_of_meshes_are_compared(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    trimesh.creation.box((0.4, 0.3, 0.6)).export(tmp_path / "box.stl")
    trimesh.creation.icosphere(2).export(tmp_path / "ball.glb")
    (tmp_path / "none.obj").write_text("v 0 0 0\n")
    tab = tmp_path / "tabs.obj"
    tab.write_text("v\t0\t0\t0\nv\t1\t0\t0\nv\t0\t1\t0\nf\t1\t2\t3\n")
    monkeypatch.setattr(sys, "argv", ["mesh_readers", str(tmp_path)])
    with monkeypatch.context() as patched:
        patched.setattr(mesh_readers.logging, "disable", lambda level: None)
        mesh_readers.main()
    told = capsys.readouterr().out
    rows = {
        line.split()[0]: line.split()[1:4] for line in told.splitlines() if line.startswith(".")
    }
    assert rows[".stl"] == rows[".glb"] == ["1", "1", "0"]
    assert rows[".obj"] == ["2", "1", "1"]
    assert f"{tab}\n    ours    1 triangles, 1 x 1 x 0, area 0.5" in told
