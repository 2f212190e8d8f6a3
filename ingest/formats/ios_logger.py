"""ios_logger (and its relatives): ARposes.txt, Frames.txt, Accel.txt, Gyro.txt, Frames.m4v.

Commas; the app writes no header, and one that names the columns counts. Poses are ARKit's own, the
quaternion is written w first. Frames.txt holds the intrinsics of the images, a subset of the poses;
Accel.txt is in g. Time is Unix seconds.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import check_clock, check_poses, poses_from_quaternions
from ingest.formats.pose_columns import (
    INTRINSICS,
    SENSOR,
    Columns,
    header_of,
    read_columns,
    read_pose_rows,
)
from ingest.formats.text_table import first_row, floats
from ingest.session import GRAVITY, CaptureSession, ImuLog
from omomo_core.errors import InputError

NAME = "ios_logger"
FILES = "a folder with ARposes.txt"
LACKS = "no tracking state or depth"
IMAGE_SIZE = (1920, 1440)
_POSES = Columns((0, 1, 2, 3, 5, 6, 7, 4), 8, ",", second=1.0, scale=1.0)
"""The app writes no header, and the quaternion w first."""
_FRAMES = Columns((0, 2, 3, 4, 5), 6, ",", second=1.0)
_ACCEL = Columns((0, 1, 2, 3), 4, ",", second=1.0, scale=GRAVITY)
_GYRO = replace(_ACCEL, scale=1.0)


def detect(path: Path) -> bool:
    """Whether the folder has ARposes.txt, or the file's first line has its eight numbers."""
    if path.is_dir():
        return (path / "ARposes.txt").is_file()
    if path.name == "ARposes.txt":
        return True
    return len(floats(first_row(path).split(","))) == len(_POSES.places) and header_of(path) is None


def read(path: Path) -> CaptureSession:
    """Read a session folder (or the ARposes.txt in it)."""
    folder = path if path.is_dir() else path.parent
    rows = read_pose_rows(folder / "ARposes.txt" if path.is_dir() else path, _POSES)
    times = rows.clock.times
    T = poses_from_quaternions(rows.positions, rows.xyzw, rows.place)
    check_poses(times, T, rows.table.path, rows.place)
    images = _images(folder / "Frames.txt")
    intrinsics = _at(times, images[:, 0], images[:, 1:]) if images is not None else None
    video = folder / "Frames.m4v"
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=IMAGE_SIZE if images is not None else None,
        video=video if video.is_file() else None,
        video_times=images[:, 0] if images is not None else None,
        imu=_read_imu(folder),
    )


def _images(path: Path) -> Float64[np.ndarray, "images 5"] | None:
    """Seconds, fx, fy, cx and cy of each image; None where the app wrote no image."""
    rows = read_columns(path, INTRINSICS, _FRAMES) if path.is_file() else None
    if rows is None or not rows.table.lines:
        return None
    times = rows.clock.times
    check_clock(times, rows.table.place)
    return np.column_stack([times, rows.table.values[:, 1:]])


def _read_imu(folder: Path) -> ImuLog | None:
    """Gyroscope samples brought to the accelerometer's stamps where both ran."""
    files = folder / "Accel.txt", folder / "Gyro.txt"
    if not all(file.is_file() for file in files):
        return None
    accel, gyro = _by_time(files[0], _ACCEL), _by_time(files[1], _GYRO)
    if min(len(accel), len(gyro)) < 2:
        return None
    accel = accel[(accel[:, 0] >= gyro[0, 0]) & (accel[:, 0] <= gyro[-1, 0])]
    if len(accel) < 2:
        raise InputError(
            "imu-apart",
            "The accelerometer's and the gyroscope's logs have no time in common.",
            where=f"{files[0]}, {files[1].name}",
            fix="Give both logs of this very take, or leave both out.",
        )
    times = accel[:, 0]
    return ImuLog(times=times, accel=accel[:, 1:], gyro=_at(times, gyro[:, 0], gyro[:, 1:]))


def _by_time(path: Path, usual: Columns) -> Float64[np.ndarray, "rows 4"]:
    """Seconds and what the sensor read, in the order of time."""
    rows = read_columns(path, SENSOR, usual)
    times = rows.clock.times
    order = np.argsort(times, kind="stable")
    return np.column_stack([times, rows.table.values[:, 1:]])[order]


def _at(
    times: Float64[np.ndarray, " frames"],
    known_times: Float64[np.ndarray, " known"],
    known: Float64[np.ndarray, "known columns"],
) -> Float64[np.ndarray, "frames columns"]:
    """Linear interpolation of each column."""
    return np.stack([np.interp(times, known_times, column) for column in known.T], axis=1)
