"""Calibrate from one recording, run another with it: the object's poses are right."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from capture_app.simulator.demo_take import box_mesh, carried_box, clamped_phone, write_recording
from capture_app.simulator.simulated_phone import (
    BOOT_SECONDS,
    PhoneNoise,
    arkit_from_world,
    simulate,
)
from ingest.formats.registry import read_session
from ingest.mount_file import load_mount
from ingest.trajectory.object_motion import to_object_motion
from omomo_core.geometry.transforms import inverse
from tests.simulator.wiggle import Wiggle, wiggle_motion

NO_DRIFT = replace(PhoneNoise(), drift=0.0)


def _phone(folder: Path, kind: Wiggle = "all axes") -> Path:
    session = simulate(wiggle_motion(kind, seed=1), clamped_phone(), seed=1, noise=NO_DRIFT)
    write_recording(session, folder)
    return folder


def _tracker(path: Path, kind: Wiggle = "all axes") -> Path:
    """Motion capture of the box itself at 120 Hz, half a millimetre off, on its own clock."""
    motion, rng = wiggle_motion(kind, seed=1), np.random.default_rng(0)
    times = np.arange(len(motion.T_world_object)) / 30
    quaternions = Rotation.from_matrix(motion.T_world_object[:, :3, :3]).as_quat()
    places = motion.T_world_object[:, :3, 3] + rng.normal(0, 5e-4, (len(times), 3))
    rows = np.column_stack([1.7e9 + times, places, quaternions])
    np.savetxt(path, rows, fmt="%.9f", delimiter=",", header="t,x,y,z,qx,qy,qz,qw")
    return path


def _object_off(take: Path, mount: Path) -> tuple[float, float]:
    """Largest mm and deg between the object's poses of the demonstration take and the truth."""
    found = to_object_motion(read_session(take), box_mesh(), load_mount(mount))
    made = inverse(found.T_world_arkit) @ found.motion.T_world_object
    truth = carried_box().T_world_object
    truth = arkit_from_world(truth[0] @ inverse(clamped_phone().T_phone_object)) @ truth
    count = min(len(made), len(truth))
    mm = 1e3 * np.linalg.norm(made[:count, :3, 3] - truth[:count, :3, 3], axis=1)
    turn = inverse(truth[:count]) @ made[:count]
    return float(mm.max()), float(
        np.degrees(Rotation.from_matrix(turn[:, :3, :3]).magnitude().max())
    )


@pytest.mark.runs("calibrate tracker")
def test_calibrated_by_a_tracker_another_take_is_right(tmp_path: Path):
    mount = tmp_path / "mount.json"
    log, poses = _phone(tmp_path / "wiggle"), _tracker(tmp_path / "box.csv")
    assert invoke(["calibrate", "tracker", str(log), str(poses), "-o", str(mount)]) == 0
    told = json.loads(mount.read_text())
    assert told["method"] == "tracker"
    assert told["residuals"]["clock offset_s"] == pytest.approx(BOOT_SECONDS - 1.7e9, abs=0.01)
    session = simulate(carried_box(), clamped_phone(), seed=5, noise=NO_DRIFT)
    write_recording(session, tmp_path / "take")
    mm, deg = _object_off(tmp_path / "take", mount)
    assert mm < 5
    assert deg < 0.5


def test_pushing_leaves_the_height_free_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    mount = tmp_path / "mount.json"
    log, poses = _phone(tmp_path / "wiggle", "yaw"), _tracker(tmp_path / "box.csv", "yaw")
    assert invoke(["calibrate", "tracker", str(log), str(poses), "-o", str(mount)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "the height of the object" in said
    assert "tilt the object by 20 degrees" in said
    assert "height" in load_mount(mount).free[0]


def test_nothing_is_written_when_it_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    mount = tmp_path / "mount.json"
    log = _phone(tmp_path / "wiggle", "translation")
    poses = _tracker(tmp_path / "box.csv", "translation")
    assert invoke(["calibrate", "tracker", str(log), str(poses), "-o", str(mount)]) == 2
    assert "calibration-turns" in capsys.readouterr().err
    assert not mount.exists()


def test_a_mount_is_never_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    mount = tmp_path / "mount.json"
    mount.write_text("precious")
    assert invoke(["calibrate", "tracker", "none", "none", "-o", str(mount)]) == 2
    assert "output-exists" in capsys.readouterr().err
    assert mount.read_text() == "precious"


@pytest.mark.parametrize("copied", ["its file", "its poses as TUM, from zero and z up"])
def test_the_phones_own_log_is_no_trackers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], copied: str
):
    log, mount = _phone(tmp_path / "wiggle"), tmp_path / "mount.json"
    poses = log / "odometry.csv"
    if copied != "its file":
        session = read_session(log)
        R = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
        q = Rotation.from_matrix(R @ session.T_world_phone[:, :3, :3] @ np.diag([1, -1, -1]))
        times = session.times - session.times[0]
        rows = np.column_stack([times, session.T_world_phone[:, :3, 3] @ R.T, q.as_quat()])
        poses = tmp_path / "box.txt"
        np.savetxt(poses, rows, "%.6f")
    assert invoke(["calibrate", "tracker", str(log), str(poses), "-o", str(mount)]) == 2
    told = capsys.readouterr().err
    assert "tracker-is-phone" in told
    assert f"{poses.name} is the log of the phone itself" in " ".join(told.split())
    assert not mount.exists()


@pytest.mark.slow
def test_calibrated_by_a_film_of_a_board_another_take_is_right(tmp_path: Path):
    from ingest.calibration.board.board_sheet import preset_for
    from tests.simulator.witness import board_on_box, record_witness, tripod

    board, mount = preset_for("A4"), tmp_path / "mount.json"
    on_box, log = board_on_box(board), _phone(tmp_path / "wiggle")
    witness = tripod(rate=10.0, start=0.7)
    record_witness(tmp_path / "board.mp4", wiggle_motion(seed=1), board, on_box, witness)
    (tmp_path / "place.txt").write_text("\n".join(" ".join(map(str, row)) for row in on_box))
    arguments = ["calibrate", "board", str(log), str(tmp_path / "board.mp4"), "--board", "A4"]
    arguments += ["--board-place", str(tmp_path / "place.txt"), "-o", str(mount)]
    assert invoke([*arguments, "--camera", str(tmp_path / "camera.json")]) == 0
    session = simulate(carried_box(), clamped_phone(), seed=5, noise=NO_DRIFT)
    write_recording(session, tmp_path / "take")
    mm, deg = _object_off(tmp_path / "take", mount)
    assert mm < 5
    assert deg < 0.5
