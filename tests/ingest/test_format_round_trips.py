"""Every format reads back what it writes, to the precision it prints."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.formats import arkit_data_logger, ios_logger, stray_scanner
from ingest.formats.detect import Format, read_session
from ingest.session import CaptureSession

seeds = st.integers(0, 2**32 - 1)


def _round_trip(format_: Format, session: CaptureSession) -> CaptureSession:
    with tempfile.TemporaryDirectory() as folder:
        written = format_.write(session, Path(folder) / "take")
        back = read_session(written)
    assert back.app == format_.NAME
    return back


def _same_imu(back: CaptureSession, session: CaptureSession, tolerance: float) -> None:
    assert back.imu is not None
    assert session.imu is not None
    np.testing.assert_allclose(back.imu.times, session.imu.times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.imu.accel, session.imu.accel, rtol=0, atol=tolerance)
    np.testing.assert_allclose(back.imu.gyro, session.imu.gyro, rtol=0, atol=tolerance)


@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_stray_scanner(wander: Callable[..., CaptureSession], seed: int):
    session = wander(seed, seconds=1.2)
    back = _round_trip(stray_scanner, session)
    np.testing.assert_array_equal(back.times, session.times)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=6e-7)
    np.testing.assert_allclose(back.intrinsics, session.intrinsics, rtol=1e-7)
    assert back.image_size == (1920, 1440)
    np.testing.assert_array_equal(back.video_times, session.times)
    _same_imu(back, session, 1e-12)


@settings(max_examples=8, deadline=None)
@given(seed=seeds, every=st.sampled_from([1, 2]))
def test_ios_logger(wander: Callable[..., CaptureSession], seed: int, every: int):
    session = wander(seed, seconds=1.2)
    images = session.times[::every]
    assert session.intrinsics is not None
    slow = np.stack(
        [np.interp(session.times, images, k) for k in session.intrinsics[::every].T], axis=1
    )
    session = replace(session, video_times=images, intrinsics=slow)
    back = _round_trip(ios_logger, session)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=4e-6)
    np.testing.assert_allclose(back.intrinsics, session.intrinsics, rtol=0, atol=1e-3)
    assert back.video_times is not None
    np.testing.assert_allclose(back.video_times, images, rtol=0, atol=1e-6)
    assert session.imu is not None
    inner = replace(session.imu, times=session.imu.times.round(6))
    _same_imu(back, replace(session, imu=inner), 1e-5)


@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_arkit_data_logger(wander: Callable[..., CaptureSession], seed: int):
    session = wander(seed, seconds=1.2)
    back = _round_trip(arkit_data_logger, session)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=1e-9)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=2e-6)
    assert back.intrinsics is None
    assert back.imu is None


def test_stray_before_2026_takes_the_one_camera_matrix(wander, tmp_path: Path):
    session = replace(wander(1), intrinsics=None, image_size=None, imu=None)
    stray_scanner.write(session, tmp_path)
    assert (
        (tmp_path / "odometry.csv")
        .read_text()
        .startswith("timestamp, frame, x, y, z, qx, qy, qz, qw\n")
    )
    assert read_session(tmp_path).intrinsics is None
    (tmp_path / "camera_matrix.csv").write_text("1500.0, 0.0, 950.0\n0.0, 1501.0, 710.0\n0, 0, 1\n")
    back = read_session(tmp_path / "odometry.csv")
    assert back.intrinsics is not None
    assert back.intrinsics[7].tolist() == [1500, 1501, 950, 710]


REAL_ROWS = """timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy, distortion_center_x, distortion_center_y
65575.597600791, 000000, -0.05574204, 0.019246144, 0.23901562, 0.71036303, -0.58647335, -0.07790033, 0.38126758, 1597.8881, 1597.8881, 955.3694, 717.7071, , 
65575.614270041, 000001, -0.05602985, 0.019177599, 0.23894715, 0.7087146, -0.5875125, -0.08093561, 0.3821022, 1597.8881, 1597.8881, 955.36646, 717.7111, , 
66575.680947291, 000003, -0.05798644, 0.019260399, 0.2367798, 0.70585245, -0.58915436, -0.08375125, 0.3842591, 1597.8881, 1597.8881, 955.363, 717.72205, , 
"""  # noqa: E501


def test_stray_rows_of_the_2026_app(tmp_path: Path):
    (tmp_path / "odometry.csv").write_text(REAL_ROWS)
    session = read_session(tmp_path)
    assert session.times[0] == 65575.597600791
    np.testing.assert_allclose(
        session.T_world_phone[0, :3, 3], [-0.05574204, 0.019246144, 0.23901562]
    )
    assert session.intrinsics is not None
    np.testing.assert_allclose(session.intrinsics[1], [1597.8881, 1597.8881, 955.36646, 717.7111])
    # OpenCV's camera looks along +z, ARKit's along -z: the logged z axis is the view direction.
    x, y, z, w = 0.71036303, -0.58647335, -0.07790033, 0.38126758
    view = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    np.testing.assert_allclose(-session.T_world_phone[0, :3, 2], view, atol=1e-6)


@pytest.mark.parametrize("unit", [1.0, 9.80665])
def test_stray_imu_in_g_or_in_si(wander, tmp_path: Path, unit: float):
    stray_scanner.write(replace(wander(2), imu=None), tmp_path)
    rows = [f"{65575.5 + i / 100}, {0.02 * unit}, {-unit}, 0.0, 0.1, 0.2, 0.3" for i in range(50)]
    header = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z"
    (tmp_path / "imu.csv").write_text("\n".join([header, *rows, ""]))
    imu = read_session(tmp_path).imu
    assert imu is not None
    np.testing.assert_allclose(imu.accel[3], [0.02 * 9.80665, -9.80665, 0], atol=1e-9)
    np.testing.assert_allclose(imu.gyro[3], [0.1, 0.2, 0.3])


def test_video_travels_with_the_session(wander, tmp_path: Path):
    (tmp_path / "clip.mp4").write_bytes(b"pictures")
    session = replace(wander(3), video=tmp_path / "clip.mp4")
    for format_ in (stray_scanner, ios_logger):
        back = read_session(format_.write(session, tmp_path / format_.NAME))
        assert back.video is not None
        assert back.video.read_bytes() == b"pictures"
