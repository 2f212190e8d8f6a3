"""AnySense: AR_Pose_<date>.txt, poses only.

Lines `"<t_ms>" ,qx,qy,qz,qw,tx,ty,tz`: ARKit's own poses. The stamp is Unix time in milliseconds,
taken when the line was written, not when the frame was: it jitters and may repeat.
"""

from dataclasses import replace
from pathlib import Path

from ingest.formats.camera_poses import check_poses, poses_from_quaternions
from ingest.formats.text_table import first_row, floats, logs, numbers, only_log, read_rows
from ingest.session import CaptureSession

NAME = "AnySense"
FILES = "AR_Pose_<date>.txt, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; times are those of writing, not of the frames"
_WIDTH = 8


def detect(path: Path) -> bool:
    """Whether the file, or a .txt file of the folder, has a stamp in quotes and seven numbers."""
    return bool(logs(path, ("*.txt",), _is_log))


def read(path: Path) -> CaptureSession:
    """Read a pose file, or a folder that holds exactly one."""
    text = read_rows(only_log(path, logs(path, ("*.txt",), _is_log)), ",")
    bare = tuple((row[0].strip('"<>'), *row[1:]) for row in text.rows)
    table = numbers(replace(text, rows=bare), _WIDTH, range(_WIDTH))
    times = table.values[:, 0] * 1e-3
    T = poses_from_quaternions(table.values[:, 5:8], table.values[:, 1:5], table.place)
    check_poses(times, T, table.path, table.place)
    return CaptureSession(app=NAME, source=path, times=times, T_world_phone=T)


def _is_log(file: Path) -> bool:
    stamp, *pose = first_row(file).split(",")
    stamp = stamp.strip()
    return (
        stamp.startswith('"<')
        and stamp.endswith('>"')
        and stamp[2:-2].isdigit()
        and len(floats(pose)) == _WIDTH - 1
    )
