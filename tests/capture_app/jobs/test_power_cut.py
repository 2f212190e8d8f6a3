"""What a job has finished is on the disk before its record says so."""

from pathlib import Path

import numpy as np
import pytest
from power import Disk, disk
from scipy.spatial.transform import Rotation

from capture_app.commands.calibrate import CalibrateRequest, TrackerWay
from capture_app.commands.export import ExportRequest
from capture_app.commands.render import RenderRequest
from capture_app.commands.request import Request
from capture_app.commands.run import RunRequest
from capture_app.jobs.job_kinds import KINDS, Attempt
from capture_app.simulator.demo_take import clamped_phone, write_recording
from capture_app.simulator.simulated_phone import simulate
from omomo_core.motion import FPS
from tests.simulator.wiggle import wiggle_motion

assert disk


def cut_after_each_stage(order: Request, disk: Disk) -> None:
    """Each stage counts as finished once it is settled; nothing of it may be lost then."""
    attempt = Attempt("0" * 16, lambda stage, done: None, lambda said: None, lambda about: None)
    work = KINDS[order.KIND].start(order, attempt)
    part = order.output.parent / f".{order.output.name}.{attempt.id}.part"
    for name, stage in work.stages.items():
        stage()
        work.settle()
        if part.exists():
            assert [path for path in disk.lost(part) if path != str(part.parent)] == [], name
    assert order.output.exists()
    assert disk.lost(order.output) == []


def test_a_model_disk_forgets_what_was_not_flushed(tmp_path: Path, disk: Disk) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b.txt").write_text("said")
    assert disk.lost(tmp_path / "a") == [
        str(tmp_path / "a"),
        str(tmp_path / "a" / "b.txt"),
        str(tmp_path),
    ]


def test_a_motion_a_video_and_an_export(inputs, weights: Path, tmp_path: Path, disk: Disk) -> None:
    order = RunRequest(
        session=inputs.session,
        object=inputs.mesh,
        mount=inputs.mount,
        output=tmp_path / "made" / "motion",
        samples=1,
        steps=1,
        weights=weights,
        video_size=(64, 64),
    )
    (tmp_path / "made").mkdir()
    cut_after_each_stage(order, disk)
    (tmp_path / "exports").mkdir()
    result, exports = order.output, tmp_path / "exports"
    cut_after_each_stage(ExportRequest(result=result, output=exports / "a.csv", to="csv"), disk)
    still = RenderRequest(result=result, output=exports / "a.png", size=(64, 64), still=0.5)
    cut_after_each_stage(still, disk)


def test_a_mount(tmp_path: Path, disk: Disk) -> None:
    motion = wiggle_motion("all axes", seed=1)
    write_recording(simulate(motion, clamped_phone(), seed=1), tmp_path / "log")
    T = motion.T_world_object
    turns = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    rows = np.column_stack([np.arange(len(T)) / FPS, T[:, :3, 3], turns])
    np.savetxt(tmp_path / "poses.txt", rows)
    (tmp_path / "mounts").mkdir()
    way = TrackerWay(session=tmp_path / "log", poses=tmp_path / "poses.txt")
    cut_after_each_stage(CalibrateRequest(output=tmp_path / "mounts" / "one", way=way), disk)


def test_inputs_are_read_once_to_be_hashed(
    inputs, weights: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import hashlib

    from capture_app.manifest import read_manifest, sha256

    known = {path: sha256(path) for path in (inputs.session, inputs.mesh, inputs.mount)}
    read: list[str] = []
    digest = hashlib.file_digest

    def heard(file, name):
        read.append(file.name)
        return digest(file, name)

    monkeypatch.setattr(hashlib, "file_digest", heard)
    order = RunRequest(
        session=inputs.session,
        object=inputs.mesh,
        mount=inputs.mount,
        output=tmp_path / "motion",
        samples=1,
        steps=1,
        weights=weights,
        video_size=None,
    )
    attempt = Attempt("0" * 16, lambda stage, done: None, lambda said: None, lambda about: None)
    for stage in KINDS["run"].start(order, attempt).stages.values():
        stage()
    told = {
        given.path: given.sha256 for given in read_manifest(order.output / "manifest.json").inputs
    }
    assert told == {str(path): digest for path, digest in known.items()}
    assert not [name for name in read if str(inputs.folder) in name]
    (inputs.mesh).write_text(inputs.mesh.read_text() + "# a word\n")
    assert sha256(inputs.mesh) != known[inputs.mesh]
