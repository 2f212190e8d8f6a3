"""ARKit Data Logger: ARKit_camera_pose.txt, poses only.

A # line, then `t_ns r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz`: ARKit camera axes and world,
nanoseconds since boot.
"""

from pathlib import Path

from ingest.formats.camera_poses import check_poses, poses_from_matrices
from ingest.formats.text_table import first_row, numbers, read_rows
from ingest.session import CaptureSession
from omomo_core.errors import InputError

NAME = "ARKit Data Logger"
FILES = "ARKit_camera_pose.txt, or a folder with one"
LACKS = "no tracking state, intrinsics, images or IMU"
_WIDTH = 13


def detect(path: Path) -> bool:
    """Whether the file, or a .txt file of the folder, has thirteen numbers a line."""
    return bool(_trajectories(path)) if path.is_dir() else _is_trajectory(path)


def read(path: Path) -> CaptureSession:
    """Read a trajectory file, or a folder that holds exactly one."""
    files = _trajectories(path) if path.is_dir() else [path]
    if len(files) != 1:
        raise InputError(
            "session-ambiguous",
            f"The folder holds {len(files)} trajectories: {', '.join(f.name for f in files)}.",
            where=str(path),
            fix="Pass one of these files instead of the folder.",
        )
    table = numbers(read_rows(files[0], None), _WIDTH, range(_WIDTH))
    times = table.values[:, 0] * 1e-9
    T = poses_from_matrices(table.values[:, 1:].reshape(-1, 3, 4), table.place)
    check_poses(times, T, table.path, table.place)
    return CaptureSession(app=NAME, source=path, times=times, T_world_phone=T)


def _trajectories(folder: Path) -> list[Path]:
    return sorted(file for file in folder.glob("*.txt") if file.is_file() and _is_trajectory(file))


def _is_trajectory(file: Path) -> bool:
    if file.name.startswith("ARKit_camera_pose"):
        return True
    fields = first_row(file).split()
    return len(fields) == _WIDTH and fields[0].isdecimal() and len(fields[0]) > 9
