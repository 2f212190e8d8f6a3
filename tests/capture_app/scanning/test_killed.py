"""A scan that is shot again and again goes on where it was, and comes to the same mesh."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import igl
import numpy as np
import pytest

from ingest.mesh import load_mesh
from ingest.scan.scan_choices import DRAFT
from tests.capture_app.scanning.filmed import film_small

_OMOCAP = Path(sys.executable).with_name("omocap")


def _shot(words: list[str], ready: Callable[[], bool]) -> None:
    """Run the command and kill it as soon as it is so far."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with subprocess.Popen([_OMOCAP, *words], env=environment, stdout=subprocess.DEVNULL) as process:
        until = time.monotonic() + 300
        while not ready():
            assert process.poll() is None, "it ended before it could be shot"
            assert time.monotonic() < until
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL


def _made(work: Path) -> dict[str, int]:
    """When the files of the slow stages were written."""
    files = [f for made in ("images/*", "sparse/*", "stereo/*/*.npy") for f in work.glob(made)]
    return {str(file): file.stat().st_mtime_ns for file in files}


@pytest.mark.slow
def test_a_draft_that_is_killed_goes_on(tmp_path: Path) -> None:
    film = film_small(tmp_path / "film")
    mesh, work = tmp_path / "box.glb", tmp_path / "box.scan"
    words = ["scan", str(film.path), "-o", str(mesh), "--draft"]
    _shot(words, lambda: len(list(work.glob("images/*.jpg"))) > 4)
    _shot(words, lambda: (work / "database.db-wal").exists() or (work / "colmap").exists())
    assert not mesh.exists()
    before = _made(work)
    assert len(before) >= 24
    subprocess.run([_OMOCAP, *words], check=True, stdout=subprocess.DEVNULL)
    after = _made(work)
    assert {file: after[file] for file in before} == before
    assert len(load_mesh(mesh).faces) > 500
    report = json.loads((work / "report.json").read_text())
    assert (report["method"], report["voxel"]) == ("both", DRAFT.voxel)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_scan_that_is_killed_goes_on(tmp_path: Path) -> None:
    film = film_small(tmp_path / "film")
    mesh, work = tmp_path / "box.glb", tmp_path / "box.scan"
    words = ["scan", str(film.path), "-o", str(mesh), "--method", "stereo"]
    _shot(words, lambda: len(list(work.glob("images/*.jpg"))) > 4)
    _shot(words, lambda: (work / "database.db-wal").exists() or (work / "colmap").exists())
    _shot(words, lambda: (work / "colmap").exists())
    _shot(words, lambda: len(list(work.glob("stereo/*/*.npy"))) > 4)
    assert not mesh.exists()
    before = _made(work)
    assert len(before) > 24 + 4
    subprocess.run([_OMOCAP, *words], check=True, stdout=subprocess.DEVNULL)
    after = _made(work)
    assert {file: after[file] for file in before} == before

    # The same cameras, their depth measured without an interruption.
    resumed = mesh.read_bytes()
    shutil.rmtree(work / "stereo")
    subprocess.run([_OMOCAP, *words, "--replace"], check=True, stdout=subprocess.DEVNULL)
    assert mesh.read_bytes() == resumed

    T = film.T_scan_object
    placed = np.array(json.loads((work / "report.json").read_text())["T_world_object"])
    true = film.scene.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    points = load_mesh(mesh).vertices @ placed[:3, :3].T + placed[:3, 3]
    off = np.sqrt(igl.point_mesh_squared_distance(points, true, film.scene.mesh.faces)[0])
    assert np.median(off) < 0.006
