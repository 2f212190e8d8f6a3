"""inspect_session names what is wrong with a take, where, and what to do."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.report.check import Check
from ingest.report.inspect import inspect_session
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog


def _checks(session: CaptureSession) -> dict[str, Check]:
    report = inspect_session(session)
    found = {check.name: check for check in report.checks}
    assert all(check.fix for check in report.checks if check.severity != "ok")
    return found


def _honest_imu(session: CaptureSession) -> ImuLog:
    down = np.tile([0.0, -GRAVITY, 0.0], (len(session.times), 1))
    camera = Rotation.from_matrix(session.T_world_phone[:, :3, :3]).inv().apply(down)
    accel = camera @ R_CAMERA_DEVICE
    return ImuLog(session.times, accel, np.zeros_like(accel))


def test_a_good_take(wander):
    session = wander(0, seconds=6.0)
    session = replace(session, imu=_honest_imu(session))
    report = inspect_session(session)
    assert {c.name: c.severity for c in report.checks if c.severity != "ok"} == {"floor": "warn"}
    assert report.severity == "warn"
    found = _checks(session)
    assert found["duration"].message == "6.0 s, 361 poses"
    assert "60.0 poses a second" in found["rate"].message
    assert "0.0 deg" in found["gravity"].message


def test_an_object_at_rest_gives_the_floor(wander):
    session = wander(1, seconds=5.0)
    poses = session.T_world_phone.copy()
    poses[:70] = poses[70]
    poses[:, :3, 3] += np.random.default_rng(0).normal(scale=3e-4, size=(len(poses), 3))
    floor = _checks(replace(session, T_world_phone=poses, imu=None))["floor"]
    assert floor.severity == "ok"
    assert floor.frames is not None
    assert floor.frames[0] == 0
    assert 66 <= floor.frames[1] <= 74


def test_faults_carry_their_frames(wander):
    session = wander(2, seconds=6.0)
    poses = session.T_world_phone.copy()
    poses[100:, 0, 3] += 0.5
    poses[200:230] = poses[200]
    times = session.times.copy()
    times[300:] += 0.4
    checks = _checks(replace(session, T_world_phone=poses, times=times, imu=None))
    assert checks["tracking jump"].frames == (99, 101)
    assert checks["frozen tracking"].frames == (200, 231)
    assert checks["repeated poses"].severity == "warn"
    assert checks["gap in the log"].frames == (299, 301)
    assert inspect_session(replace(session, T_world_phone=poses)).severity == "bad"


def test_gravity_that_disagrees_with_the_poses(wander):
    session = wander(3, seconds=6.0)
    imu = _honest_imu(session)
    sideways = replace(imu, accel=imu.accel[:, [1, 0, 2]] * [1, -1, 1])
    check = _checks(replace(session, imu=sideways))["gravity"]
    assert check.severity == "bad"
    assert "axes" in check.fix


def test_a_slow_fast_and_short_take(wander):
    slow = wander(4, seconds=6.0, rate=12.0)
    assert _checks(replace(slow, imu=None))["rate"].severity == "warn"
    assert _checks(replace(wander(4, seconds=2.0), imu=None))["duration"].severity == "warn"
    fast = wander(4, seconds=6.0)
    quick = replace(fast, times=fast.times[0] + (fast.times - fast.times[0]) / 5, imu=None)
    quick = _checks(quick)
    assert quick["speed"].severity != "ok" or quick["rotation speed"].severity != "ok"


def test_a_damaged_video_and_odd_intrinsics(wander, tmp_path: Path):
    (tmp_path / "rgb.mp4").write_bytes(b"no video")
    session = wander(5)
    assert session.intrinsics is not None
    intrinsics = session.intrinsics.copy()
    intrinsics[7] = 0
    session = replace(session, video=tmp_path / "rgb.mp4", intrinsics=intrinsics, imu=None)
    checks = _checks(session)
    assert checks["video"].severity == "bad"
    assert checks["intrinsics"].severity == "bad"
