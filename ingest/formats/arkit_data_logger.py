"""ARKit Data Logger: ARKit_camera_pose.txt, poses only.

A # line, then `t_ns r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz`: ARKit camera axes and world,
nanoseconds since boot.
"""

from pathlib import Path

import numpy as np

from ingest.formats.camera_poses import check_poses, poses_from_matrices
from ingest.formats.pose_columns import MATRICES, Columns, first_pose, header_of, read_columns
from ingest.formats.text_table import logs, only_log
from ingest.session import CaptureSession

NAME = "ARKit Data Logger"
FILES = "ARKit_camera_pose.txt, or a folder with one"
LACKS = "no tracking state, intrinsics, images or IMU"
_PATTERNS = ("*.txt",)
_COLUMNS = Columns((0, 1, 2, 3, 5, 6, 7, 9, 10, 11, 4, 8, 12), 13, None, second=1e-9, scale=1.0)
"""The app names no columns; nanoseconds."""


def detect(path: Path) -> bool:
    """Whether the file, or a .txt file of the folder, has thirteen numbers a line."""
    return bool(logs(path, _PATTERNS, _is_trajectory))


def read(path: Path) -> CaptureSession:
    """Read a trajectory file, or a folder that holds exactly one."""
    log = only_log(path, logs(path, _PATTERNS, _is_trajectory))
    rows = read_columns(log, MATRICES, _COLUMNS)
    times, values, place = rows.clock.times, rows.table.values, rows.table.place
    R, t = values[:, 1:10].reshape(-1, 3, 3), values[:, 10:, None]
    T = poses_from_matrices(np.concatenate([R, t], axis=2), place)
    check_poses(times, T, log, place)
    return CaptureSession(app=NAME, source=path, times=times, T_world_phone=T)


def _is_trajectory(file: Path) -> bool:
    if file.name.startswith("ARKit_camera_pose"):
        return True
    fields = first_pose(file, header_of(file, MATRICES)).split()
    return len(fields) == _COLUMNS.width and fields[0].isdecimal() and len(fields[0]) > 9
