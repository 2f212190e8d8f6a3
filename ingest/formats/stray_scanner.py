"""Stray Scanner: odometry.csv, camera_matrix.csv, imu.csv, rgb.mp4, depth maps in one folder.

Positions are ARKit's; rotations carry OpenCV camera axes (the app multiplies by 180 deg about x)
in the y-up ARKit world. Since 2026 each row also carries the intrinsics. The video's stamps are
frame/60, not time: the picture of a row in rgb.mp4 is that of its frame number. imu.csv is in g
(though its documentation says m/s^2), so its unit is told from its size.
"""

import shutil
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64
from scipy.spatial.transform import Rotation

from ingest.formats.camera_poses import check_poses, poses_from_quaternions
from ingest.formats.still_images import depth_log_mm, file_inside, write_depth_mm
from ingest.formats.text_table import NumberTable, TextRows, first_row, numbers, read_rows
from ingest.session import GRAVITY, CaptureSession, ImuLog
from omomo_core.errors import InputError

NAME = "Stray Scanner"
FILES = "a folder with odometry.csv"
LACKS = "no tracking state; needs LiDAR"

POSE_COLUMNS = ("timestamp", "x", "y", "z", "qx", "qy", "qz", "qw")
CAMERA_COLUMNS = ("fx", "fy", "cx", "cy")
IMU_COLUMNS = ("timestamp", "a_x", "a_y", "a_z", "alpha_x", "alpha_y", "alpha_z")
IMAGE_SIZE = (1920, 1440)
_MOST_FRAMES = 10**9
_FLIP = np.diag([1.0, -1.0, -1.0])
"""OpenCV camera axes (y down, z forward) and ARKit's (y up, z back) turn into each other."""


def detect(path: Path) -> bool:
    """Whether the folder (or file) is a Stray Scanner session, by the columns of its table."""
    log = _odometry(path)
    if not log.is_file():
        return False
    names = {name.strip() for name in first_row(log).lower().split(",")}
    if {"timestamp", "qx", "qw"} <= names:
        return "frame" in names  # without frame numbers it is somebody's table of poses
    return path.is_dir()


def read(path: Path) -> CaptureSession:
    """Read a session folder (or the odometry.csv in it)."""
    log = _odometry(path)
    folder = log.parent
    text = read_rows(log, ",")
    table = _columns(text, POSE_COLUMNS)
    T = poses_from_quaternions(table.values[:, 1:4], table.values[:, 4:8], table.place)
    T[:, :3, :3] = T[:, :3, :3] @ _FLIP
    check_poses(table.values[:, 0], T, table.path, table.place)
    intrinsics = _intrinsics(text, folder / "camera_matrix.csv", len(T))
    video = folder / "rgb.mp4"
    return CaptureSession(
        app=NAME,
        source=path,
        times=table.values[:, 0],
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=IMAGE_SIZE if intrinsics is not None else None,
        video=video if video.is_file() else None,
        video_times=table.values[:, 0],
        video_numbers=_numbers(text, len(T)),
        imu=_read_imu(folder / "imu.csv"),
        depth=depth_log_mm(table.values[:, 0], _depth_maps(text, folder, len(T))),
    )


def write(session: CaptureSession, folder: Path) -> Path:
    """Write the session as the app does (poses in its single precision); returns the folder.

    Without intrinsics the columns are those of the app before 2026.
    """
    folder.mkdir(parents=True, exist_ok=True)
    R = session.T_world_phone[:, :3, :3] @ _FLIP
    quaternions = Rotation.from_matrix(R).as_quat()
    poses = np.concatenate([session.T_world_phone[:, :3, 3], quaternions], axis=1)
    header, tail = "timestamp, frame, x, y, z, qx, qy, qz, qw", [""] * len(poses)
    if session.intrinsics is not None:
        header += ", fx, fy, cx, cy, distortion_center_x, distortion_center_y"
        tail = [f", {_singles(row)}, , " for row in session.intrinsics]
        _write_camera_matrix(session.intrinsics[-1], folder / "camera_matrix.csv")
    lines = [
        f"{float(t)!r}, {i:06d}, {_singles(poses[i])}{tail[i]}" for i, t in enumerate(session.times)
    ]
    (folder / "odometry.csv").write_text("\n".join([header, *lines, ""]), encoding="utf-8")
    if session.imu is not None:
        _write_imu(session.imu, folder / "imu.csv")
    if session.video is not None:
        shutil.copyfile(session.video, folder / "rgb.mp4")
    write_depth_mm(session, lambda i: folder / "depth" / f"{i:06d}.png")
    return folder


def _odometry(path: Path) -> Path:
    return path / "odometry.csv" if path.is_dir() else path


def _columns(text: TextRows, names: tuple[str, ...]) -> NumberTable:
    """The named columns, wherever the header puts them."""
    header = [name.lower() for name in text.rows[0]] if text.rows else []
    missing = [name for name in names if name not in header]
    if missing:
        raise InputError(
            "log-columns",
            f"{text.path.name} has no column {', '.join(missing)}"
            f"{': the file is empty' if not header else ''}.",
            where=f"{text.path}:1",
            fix="Give the folder as Stray Scanner wrote it, with the header line "
            f"{', '.join(names)}.",
        )
    doubled = [name for name in names if header.count(name) > 1]
    if doubled:
        raise InputError(
            "header-unclear",
            f"The header of {text.path.name} names more than one column for {', '.join(doubled)}.",
            where=f"{text.path}:{text.lines[0]}",
            fix="Name each column once.",
        )
    return numbers(text.without_header(), len(header), [header.index(name) for name in names])


def _intrinsics(
    text: TextRows, matrix_file: Path, frames: int
) -> Float64[np.ndarray, "frames 4"] | None:
    """Per row where the app logs them, else the one matrix it wrote at the end."""
    if set(CAMERA_COLUMNS) <= {name.lower() for name in text.rows[0]}:
        return _columns(text, CAMERA_COLUMNS).values
    if not matrix_file.is_file():
        return None
    K = numbers(read_rows(matrix_file, ","), 3, range(3))
    if K.values.shape != (3, 3):
        raise InputError(
            "log-damaged", "The camera matrix is not 3 rows of 3 numbers.", where=str(matrix_file)
        )
    fx, fy, cx, cy = K.values[0, 0], K.values[1, 1], K.values[0, 2], K.values[1, 2]
    return np.tile([fx, fy, cx, cy], (frames, 1))


def _numbers(text: TextRows, frames: int) -> Int64[np.ndarray, " frames"]:
    """The frame number of each row, by which its depth map and its picture in the film are known."""
    if "frame" not in {name.lower() for name in text.rows[0]}:
        return np.arange(frames)
    return _columns(text, ("frame",)).values[:, 0].clip(-1, _MOST_FRAMES).astype(np.int64)


def _depth_maps(text: TextRows, folder: Path, frames: int) -> list[Path | None]:
    return [file_inside(folder, f"depth/{k:06d}.png") for k in _numbers(text, frames).tolist()]


def _read_imu(path: Path) -> ImuLog | None:
    if not path.is_file():
        return None
    table = _columns(read_rows(path, ","), IMU_COLUMNS)
    if len(table.lines) < 2:
        return None
    # The app pairs two sensors and stamps each pair with the later one: order is not certain.
    rows = table.values[np.argsort(table.values[:, 0], kind="stable")]
    accel = rows[:, 1:4]
    in_g = np.median(np.abs(accel).max(axis=1)) < 3
    return ImuLog(times=rows[:, 0], accel=accel * (GRAVITY if in_g else 1.0), gyro=rows[:, 4:7])


def _write_imu(imu: ImuLog, path: Path) -> None:
    rows = np.concatenate([imu.times[:, None], imu.accel / GRAVITY, imu.gyro], axis=1)
    lines = [", ".join(repr(float(x)) for x in row) for row in rows]
    path.write_text("\n".join([", ".join(IMU_COLUMNS), *lines, ""]), encoding="utf-8")


def _write_camera_matrix(intrinsics: Float64[np.ndarray, "4"], path: Path) -> None:
    fx, fy, cx, cy = intrinsics
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    path.write_text("".join(f"{_singles(row)}\n" for row in K), encoding="utf-8")


def _singles(row: Float64[np.ndarray, " numbers"]) -> str:
    return ", ".join(str(x) for x in row.astype(np.float32))
