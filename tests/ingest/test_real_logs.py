"""Real logs of real phones: numbers measured independently of this code."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation, Slerp

from ingest.formats import ios_logger
from ingest.formats.registry import FORMATS, read_session
from ingest.mount import identity_mount
from ingest.report.clamp_checks import gravity_angles
from ingest.report.take_inspection import inspect_session
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession
from ingest.trajectory.object_motion import to_object_motion
from omomo_core.geometry.transforms import inverse
from tests.log_writers import write_session

LOGS = [
    ("ios_logger_pyojinkim", 2617, 43.7, 24.0),
    ("arkit_data_logger/ARKit_camera_pose.txt", 2762, 46.0, 23.2),
    ("arkit_data_logger/ARKit_camera_pose_LARR_letters.txt", 1653, 27.5, 13.5),
]


@pytest.fixture(scope="module")
def captures(shared: Path) -> Path:
    return shared / "data" / "capture"


@pytest.fixture(scope="module")
def ios(captures: Path) -> CaptureSession:
    return read_session(captures / "ios_logger_pyojinkim")


@pytest.mark.parametrize(("name", "count", "seconds", "metres"), LOGS)
def test_counts_durations_and_lengths(captures: Path, name, count, seconds, metres):
    session = read_session(captures / name)
    assert len(session.times) == count
    assert session.times[-1] - session.times[0] == pytest.approx(seconds, abs=0.05)
    steps = np.diff(session.T_world_phone[:, :3, 3], axis=0)
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(metres, abs=0.06)


@pytest.mark.parametrize(("name", "count", "seconds", "metres"), LOGS)
def test_they_are_whole_takes(captures: Path, box, name, count, seconds, metres):
    session = read_session(captures / name)
    take = to_object_motion(session, box, identity_mount())
    assert take.segments == ((0, len(take.motion.valid)),)
    assert (
        len(take.motion.valid) == int(seconds * 30)
        or abs(len(take.motion.valid) - seconds * 30) < 3
    )
    assert take.floor.source in ("assumed", "lowest")
    assert take.notes == (take.floor.message,)
    report = inspect_session(session)
    assert {c.name for c in report.checks if c.severity != "ok"} == {"floor"}


def test_gravity_of_core_motion(captures: Path, ios: CaptureSession):
    """The fused gravity, turned by R(device -> camera) and the poses, points down."""
    log = np.loadtxt(captures / "ios_logger_pyojinkim" / "MotARH.txt", delimiter=",")
    log = log[(log[:, 0] > ios.times[0]) & (log[:, 0] < ios.times[-1])]
    R = Slerp(ios.times, Rotation.from_matrix(ios.T_world_phone[:, :3, :3]))(log[:, 0])
    down = -R.apply(log[:, 4:7] @ R_CAMERA_DEVICE.T)[:, 1] / np.linalg.norm(log[:, 4:7], axis=1)
    angles = np.degrees(np.arccos(np.clip(down, -1, 1)))
    assert np.median(angles) < 2.5
    assert angles.max() < 7


def test_gravity_of_the_accelerometer(ios: CaptureSession):
    assert ios.imu is not None
    _, angles = gravity_angles(ios, np.array([0.0, 1.0, 0.0]))
    assert np.median(angles) == pytest.approx(1.6, abs=0.5)


def test_core_motion_signs_and_gyroscope_axes(ios: CaptureSession):
    """Accelerometer = gravity minus acceleration; gyroscope = rate of the poses: what ImuLog says."""
    assert ios.imu is not None
    clock = np.arange(ios.times[0] + 1, ios.imu.times[-1] - 1, 0.01)
    position = np.stack(
        [np.interp(clock, ios.times, p) for p in ios.T_world_phone[:, :3, 3].T], axis=1
    )
    acceleration = savgol_filter(position, 41, 3, deriv=2, delta=0.01, axis=0)
    R = Slerp(ios.times, Rotation.from_matrix(ios.T_world_phone[:, :3, :3]))

    def at(values: np.ndarray) -> np.ndarray:
        columns = [np.interp(clock, ios.imu.times, v) for v in values.T]
        return savgol_filter(np.stack(columns, axis=1), 41, 3, axis=0) @ R_CAMERA_DEVICE.T

    expected = [0, -GRAVITY, 0] - R(clock).apply(at(ios.imu.accel))
    rates = (R(clock - 0.005).inv() * R(clock + 0.005)).as_rotvec() * 100
    gyro = at(ios.imu.gyro)
    for axis in range(3):
        assert np.corrcoef(acceleration[:, axis], expected[:, axis])[0, 1] > 0.85
        assert np.corrcoef(savgol_filter(rates[:, axis], 41, 3), gyro[:, axis])[0, 1] > 0.95


def test_intrinsics_vary_and_belong_to_the_images(ios: CaptureSession):
    assert ios.intrinsics is not None
    assert ios.intrinsics[:, 0].min() == pytest.approx(1443, abs=1)
    assert ios.intrinsics[:, 0].max() == pytest.approx(1475, abs=1)
    assert ios.video_times is not None
    assert len(ios.video_times) == 1309
    assert np.isin(ios.video_times, ios.times).all()
    assert ios.intrinsics[0].tolist() == [1461.888184, 1461.888184, 963.666687, 694.755127]


def test_writing_it_again_gives_the_same_poses_file(captures: Path, ios, tmp_path: Path):
    """Byte for byte what the app wrote, but for the sign of quaternions and the last digit."""
    write_session(ios_logger, ios, tmp_path)
    ours = np.loadtxt(tmp_path / "ARposes.txt", delimiter=",")
    theirs = np.loadtxt(captures / "ios_logger_pyojinkim" / "ARposes.txt", delimiter=",")
    np.testing.assert_array_equal(ours[:, :4], theirs[:, :4])
    sign = np.sign((ours[:, 4:] * theirs[:, 4:]).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(ours[:, 4:], theirs[:, 4:] * sign, atol=2e-6)


@pytest.mark.parametrize("format_", FORMATS, ids=lambda f: f.NAME)
def test_every_app_would_have_logged_the_same_walk(ios: CaptureSession, tmp_path: Path, format_):
    """Seen from the first pose, which is all that a format with a world of its own keeps."""
    session = replace(ios, video=None, video_times=None, imu=None)
    back = read_session(write_session(format_, session, tmp_path / "take"))
    assert back.app == format_.NAME
    walked, logged = (inverse(T[0]) @ T for T in (session.T_world_phone, back.T_world_phone))
    # Decimals of the quaternions that an app prints, over 10 m.
    np.testing.assert_allclose(logged, walked, rtol=0, atol=4e-5)
    np.testing.assert_allclose(np.ptp(back.times), np.ptp(session.times), rtol=0, atol=2e-3)
