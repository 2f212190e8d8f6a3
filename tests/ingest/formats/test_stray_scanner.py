"""Stray Scanner: rows of the app before and after 2026, its IMU in two units, files that are damaged."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ingest.formats import stray_scanner
from ingest.formats.registry import read_session
from ingest.formats.still_images import save_millimetres
from tests.ingest.formats.logs import MakeTake, edit_line, error_of, write_log

REAL_ROWS = """timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy, distortion_center_x, distortion_center_y
65575.597600791, 000000, -0.05574204, 0.019246144, 0.23901562, 0.71036303, -0.58647335, -0.07790033, 0.38126758, 1597.8881, 1597.8881, 955.3694, 717.7071, , 
65575.614270041, 000001, -0.05602985, 0.019177599, 0.23894715, 0.7087146, -0.5875125, -0.08093561, 0.3821022, 1597.8881, 1597.8881, 955.36646, 717.7111, , 
66575.680947291, 000003, -0.05798644, 0.019260399, 0.2367798, 0.70585245, -0.58915436, -0.08375125, 0.3842591, 1597.8881, 1597.8881, 955.363, 717.72205, , 
"""  # noqa: E501


def test_depth_maps_bear_the_numbers_of_the_frames(tmp_path: Path):
    (tmp_path / "odometry.csv").write_text(REAL_ROWS)
    (tmp_path / "depth").mkdir()
    for number in (0, 3):
        metres = np.full((192, 256), 1.0 + number, np.float32)
        save_millimetres(metres, tmp_path / "depth" / f"{number:06d}.png")
    session = read_session(tmp_path)
    assert session.depth is not None
    np.testing.assert_array_equal(session.depth.times, session.times[[0, 2]])
    assert session.depth.load(session.depth.files[1])[0, 0] == 4.0


def test_rows_of_the_2026_app(tmp_path: Path):
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


def test_before_2026_it_takes_the_one_camera_matrix(take: MakeTake, tmp_path: Path):
    session = replace(take(1), intrinsics=None, image_size=None, imu=None)
    log = write_log(stray_scanner, session, tmp_path)
    assert log.read_text().startswith("timestamp, frame, x, y, z, qx, qy, qz, qw\n")
    assert read_session(tmp_path).intrinsics is None
    (tmp_path / "camera_matrix.csv").write_text("1500.0, 0.0, 950.0\n0.0, 1501.0, 710.0\n0, 0, 1\n")
    back = read_session(log)
    assert back.intrinsics is not None
    assert back.intrinsics[7].tolist() == [1500, 1501, 950, 710]


@pytest.mark.parametrize("unit", [1.0, 9.80665])
def test_an_imu_in_g_or_in_si(take: MakeTake, tmp_path: Path, unit: float):
    stray_scanner.write(replace(take(2), imu=None), tmp_path)
    rows = [f"{65575.5 + i / 100}, {0.02 * unit}, {-unit}, 0.0, 0.1, 0.2, 0.3" for i in range(50)]
    header = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z"
    (tmp_path / "imu.csv").write_text("\n".join([header, *rows, ""]))
    imu = read_session(tmp_path).imu
    assert imu is not None
    np.testing.assert_allclose(imu.accel[3], [0.02 * 9.80665, -9.80665, 0], atol=1e-9)
    np.testing.assert_allclose(imu.gyro[3], [0.1, 0.2, 0.3])


def test_missing_columns_and_an_empty_file(take: MakeTake, tmp_path: Path):
    log = write_log(stray_scanner, take(0), tmp_path)
    edit_line(log, 1, lambda header: header.replace("qw", "w"))
    error = error_of(tmp_path)
    assert error.code == "log-columns"
    assert "qw" in error.what
    log.write_text("")
    assert error_of(tmp_path).code == "log-columns"


def test_a_cut_imu_file_is_named(take: MakeTake, tmp_path: Path):
    stray_scanner.write(take(0), tmp_path)
    imu = tmp_path / "imu.csv"
    imu.write_text(imu.read_text()[:-30])
    error = error_of(tmp_path)
    assert error.code == "log-truncated"
    assert "imu.csv:" in error.where
