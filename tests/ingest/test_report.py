"""inspect_session names what is wrong with a take, where, and what to do."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.mount import Mount, object_id
from ingest.report.clamp_checks import mount_checks
from ingest.report.take_inspection import inspect_session
from ingest.report.take_report import Check
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog
from ingest.trajectory.rests import standing_sides, tilt_from_standing
from omomo_core.motion import ObjectMesh


def _checks(session: CaptureSession) -> dict[str, Check]:
    report = inspect_session(session)
    found = {check.name: check for check in report.checks}
    assert all(check.fix for check in report.checks if check.severity != "ok")
    return found


def _honest_imu(session: CaptureSession) -> ImuLog:
    """What the sensors of this phone would have read."""
    R = Rotation.from_matrix(session.T_world_phone[:, :3, :3])
    place, times = session.T_world_phone[:, :3, 3], session.times
    felt = [0.0, -GRAVITY, 0.0] - np.gradient(np.gradient(place, times, axis=0), times, axis=0)
    turns = (R[:-1].inv() * R[1:]).as_rotvec() / np.diff(times)[:, None]
    gyro = np.concatenate([turns, turns[-1:]])
    return ImuLog(times, R.inv().apply(felt) @ R_CAMERA_DEVICE, gyro @ R_CAMERA_DEVICE)


def test_a_good_take(wander):
    session = wander(0, seconds=6.0)
    session = replace(session, imu=_honest_imu(session))
    report = inspect_session(session)
    assert {c.name: c.severity for c in report.checks if c.severity != "ok"} == {"floor": "warn"}
    assert report.severity == "warn"
    found = _checks(session)
    assert found["duration"].message == "6.0 s, 361 poses"
    assert "60.0 poses a second" in found["rate"].message
    assert "within 0.9 deg" in found["gravity"].message


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
    # Neither is needed for the motion.
    assert checks["video"].severity == "warn"
    assert checks["intrinsics"].severity == "warn"


def test_faults_spoil_a_take_only_when_no_three_seconds_are_left(wander):
    session = replace(wander(6, seconds=8.0), imu=None)
    poses = session.T_world_phone.copy()
    poses[240:, 0, 3] += 0.5
    once = _checks(replace(session, T_world_phone=poses))["tracking jump"]
    assert once.severity == "warn"
    poses[120:, 0, 3] += 0.5
    poses[360:, 0, 3] += 0.5
    report = inspect_session(replace(session, T_world_phone=poses))
    jumps = [check for check in report.checks if check.name == "tracking jump"]
    assert [jump.frames for jump in jumps] == [(119, 121), (239, 241), (359, 361)]
    assert {jump.severity for jump in jumps} == {"bad"}
    assert report.severity == "bad"


def test_many_faults_are_summed_up(wander):
    session = replace(wander(7, seconds=8.0), imu=None)
    poses = session.T_world_phone.copy()
    for at in range(20, 460, 20):
        poses[at:, 0, 3] += 0.5
    jumps = [
        check
        for check in inspect_session(replace(session, T_world_phone=poses)).checks
        if check.name == "tracking jump"
    ]
    assert len(jumps) == 8
    assert jumps[-1].message.startswith("15 more between")
    assert jumps[-1].frames == (159, 441)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_a_box_stands_on_its_six_sides_only(seed: int):
    rng = np.random.default_rng(seed)
    corners = np.array(list(product((-1, 1), repeat=3))) * rng.uniform(0.1, 0.5, 3)
    faces = np.array([[0, 1, 3], [4, 6, 7]])
    sides = standing_sides(ObjectMesh(corners, faces, "box"))
    assert sorted(map(tuple, np.abs(sides).round(6))) == sorted(2 * list(map(tuple, np.eye(3))))
    lean = float(rng.uniform(1, 40))
    axis = rng.permutation([1.0, 0, 0])
    R = Rotation.from_rotvec(np.radians(lean) * axis) * Rotation.from_euler(
        "zyx", 90 * rng.integers(0, 4, 3), degrees=True
    )
    turned = Rotation.from_euler("z", rng.uniform(0, 6)) * R
    expected = 0.0 if axis[2] else lean
    tilt, _ = tilt_from_standing(turned.as_matrix(), sides)
    assert abs(tilt - expected) < 1e-3


def test_a_chair_stands_on_its_legs_and_not_on_their_edges():
    legs = [[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (0.003 * x, 0.45)]
    back = [[x, -0.2, 0.9] for x in (-0.2, 0.2)]
    mesh = ObjectMesh(np.array(legs + back), np.array([[0, 1, 2]]), "chair")
    sides = standing_sides(mesh)
    assert tilt_from_standing(np.eye(3), sides)[0] < 0.5
    leaning = Rotation.from_euler("x", 15, degrees=True).as_matrix()
    assert 14 < tilt_from_standing(leaning, sides)[0] < 16


def test_a_flat_mesh_and_a_wrong_mount_are_told(box):
    assert len(standing_sides(ObjectMesh(np.eye(3), np.array([[0, 1, 2]]), "sheet"))) == 0
    far = np.eye(4)
    far[:3, 3] = [0, 0, -0.7]
    good, residual = mount_checks(box, Mount(far, "hand", residuals={"rms_mm": 60.0, "views": 9.0}))
    assert good.severity == "warn"
    assert "cm from the object's surface, which takes an arm" in good.message
    assert residual.severity == "warn"
    assert "rms_mm 60" in residual.message
    far[2, 3] = -3.5
    assert mount_checks(box, Mount(far, "hand"))[0].severity == "bad"


def test_how_sure_a_mount_is_and_of_what_it_is_told(box):
    near = np.eye(4)
    near[:3, 3] = [0, 0, -0.6]
    sure = np.diag([np.radians(0.5) ** 2] * 3 + [0.005**2] * 3)

    def told(**more) -> dict[str, Check]:
        checks = mount_checks(box, Mount(near, "board", **more))
        assert all(check.fix for check in checks if check.severity != "ok")
        return {check.name: check for check in checks}

    assert set(told()) == {"phone on the object", "mount"}
    good = told(covariance=sure)["mount's error"]
    assert good.severity == "ok"
    assert "14 mm and 1.4 deg (95 %)" in good.message
    for wide in (sure + np.diag([0] * 3 + [0.02**2] * 3), sure + np.diag([0.05**2] + [0] * 5)):
        assert told(covariance=wide)["mount's error"].severity == "warn"
    free = told(covariance=sure, free=("the height of the object",))["mount's error"]
    assert free.severity == "warn"
    assert "a guess: the height of the object" in free.message
    assert "calibrate floor" in free.fix
    assert told(free=("the turn about the vertical",))["mount's error"].severity == "warn"
    assert told(object_id=object_id(box))["mount's object"].severity == "ok"
    assert told(object_id=object_id(box), object_scale=2.0)["mount's object"].severity == "bad"
    other = told(object_id="stool, 40 x 40 x 45 cm from 0 0 0")["mount's object"]
    assert other.severity == "bad"
    assert "stool" in other.message
    assert "box, 40 x 30 x 50 cm" in other.message


@settings(max_examples=15)
@given(scale=st.floats(0.3, 3.0), side=st.integers(10, 300))
def test_an_object_is_known_again_at_the_mount_s_scale(scale: float, side: int):
    corners = np.array(list(product((-1, 1), repeat=3))) * side / 400
    mesh = ObjectMesh(corners, np.array([[0, 1, 3]]), "cube")
    scaled = replace(mesh, vertices=corners * scale)
    assert object_id(scaled, scale) == object_id(mesh)
