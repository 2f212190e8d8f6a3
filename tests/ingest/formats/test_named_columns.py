"""Columns that a header or a comment names are found by these names in every format of text tables."""

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ingest.formats import anysense, arkit_data_logger, arkitscenes, ios_logger, stray_scanner
from ingest.formats.registry import read_session
from ingest.session import CaptureSession
from tests.ingest.formats.logs import MakeTake, error_of
from tests.log_writers import write_session

QUATERNION, PLACE = ("qx", "qy", "qz", "qw"), ("tx", "ty", "tz")
MATRIX = tuple(
    name
    for row in "123"
    for name in (*(f"r{row}{column}" for column in "123"), PLACE[int(row) - 1])
)
TABLES: dict[str, tuple[ModuleType, str, str, tuple[str, ...]]] = {
    "AnySense": (anysense, "*.txt", ",", ("timestamp [ms]", *QUATERNION, *PLACE)),
    "ARKit Data Logger": (arkit_data_logger, "*.txt", " ", ("timestamp[ns]", *MATRIX)),
    "ARKitScenes": (arkitscenes, "*.traj", " ", ("t", "rx", "ry", "rz", *PLACE)),
    "pincam": (arkitscenes, "*/*.pincam", " ", ("width", "height", "fx", "fy", "cx", "cy")),
    "ios_logger": (ios_logger, "ARposes.txt", ",", ("t", *PLACE, "qw", "qx", "qy", "qz")),
    "Frames.txt": (ios_logger, "Frames.txt", ",", ("t", "frame", "fx", "fy", "cx", "cy")),
    "Accel.txt": (ios_logger, "Accel.txt", ",", ("time", "acc_x [g]", "acc_y [g]", "acc_z [g]")),
    "Gyro.txt": (ios_logger, "Gyro.txt", ",", ("time", "wx", "wy", "wz")),
    "odometry.csv": (
        stray_scanner,
        "odometry.csv",
        ",",
        ("timestamp", "frame", "x", "y", "z", *QUATERNION, "fx", "fy", "cx", "cy", "dx", "dy"),
    ),
}  # fmt: skip


def rows_of(file: Path, separator: str) -> list[list[str]]:
    lines = [line for line in file.read_text().splitlines() if line and not line.startswith("#")]
    return [line.strip().split(None if separator == " " else separator) for line in lines]


def reordered(folder: Path, table: str, head: str, names: tuple[str, ...] | None = None) -> None:
    """Write the columns of a table in the opposite order, under a header that says so."""
    _, pattern, separator, usual = TABLES[table]
    for file in folder.glob(pattern):
        rows = rows_of(file, separator)
        rows = rows[1:] if table == "odometry.csv" else rows
        header = separator.join(reversed(names or usual))
        body = [separator.join(reversed(row)) for row in rows]
        file.write_text("\n".join([head + header, *body, ""]))


def same(after: CaptureSession, before: CaptureSession) -> None:
    np.testing.assert_allclose(after.times, before.times, atol=1e-9)
    np.testing.assert_allclose(after.T_world_phone, before.T_world_phone, atol=1e-12)
    assert (after.intrinsics is None) == (before.intrinsics is None)
    if before.intrinsics is not None:
        np.testing.assert_allclose(after.intrinsics, before.intrinsics, atol=1e-9)
    assert (after.imu is None) == (before.imu is None)
    if before.imu is not None:
        np.testing.assert_allclose(after.imu.accel, before.imu.accel, atol=1e-9)
        np.testing.assert_allclose(after.imu.gyro, before.imu.gyro, atol=1e-9)


@pytest.mark.parametrize("head", ["# ", ""], ids=["comment", "header"])
@pytest.mark.parametrize("table", TABLES)
def test_columns_in_another_order(take: MakeTake, tmp_path: Path, table: str, head: str):
    app = TABLES[table][0]
    folder = write_session(app, replace(take(0), video=None), tmp_path)
    before = read_session(folder)
    reordered(folder, table, head)
    if table == "odometry.csv" and head:
        assert "no column timestamp" in error_of(folder).what  # its header is a row
        return
    after = read_session(folder)
    assert after.app == app.NAME
    same(after, before)


@pytest.mark.parametrize("table", TABLES)
def test_a_column_that_is_named_twice(take: MakeTake, tmp_path: Path, table: str):
    app, _, _, names = TABLES[table]
    folder = write_session(app, replace(take(0), video=None), tmp_path)
    doubled = (*names[:-1], names[-2]) if table != "odometry.csv" else (*names[:-1], "qx")
    reordered(folder, table, "" if table == "odometry.csv" else "# ", doubled)
    error = error_of(folder)
    assert error.code == "header-unclear"
    assert "more than one column for" in error.what


def test_units_of_sensors(take: MakeTake, tmp_path: Path):
    """Accelerations in m/s^2 where the header says so; turning in degrees a second."""
    folder = write_session(ios_logger, replace(take(0), video=None), tmp_path)
    before = read_session(folder)
    for name, scale, header in (
        ("Accel.txt", 9.80665, "t,ax (m/s^2),ay (m/s^2),az (m/s^2)"),
        ("Gyro.txt", 180 / np.pi, "t,gx [deg/s],gy [deg/s],gz [deg/s]"),
    ):
        rows = [[float(x) for x in row] for row in rows_of(folder / name, ",")]
        body = [",".join(repr(v if k == 0 else v * scale) for k, v in enumerate(r)) for r in rows]
        (folder / name).write_text("\n".join([header, *body, ""]))
    same(read_session(folder), before)


def test_a_header_whose_unit_contradicts_the_stamps(take: MakeTake, tmp_path: Path):
    folder = write_session(arkit_data_logger, take(0), tmp_path)
    reordered(folder, "ARKit Data Logger", "# ", ("timestamp[s]", *MATRIX))
    error = error_of(folder)
    assert error.code == "units-unclear"
    assert "are said to be seconds" in error.what
