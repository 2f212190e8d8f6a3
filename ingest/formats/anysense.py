"""AnySense: AR_Pose_<date>.txt, poses only.

Lines `"<t_ms>" ,qx,qy,qz,qw,tx,ty,tz`: ARKit's own poses. The stamp is Unix time in milliseconds,
taken when the line was written, not when the frame was: it jitters and may repeat.
"""

from pathlib import Path

from ingest.formats.camera_poses import check_poses, poses_from_quaternions
from ingest.formats.pose_columns import Columns, first_pose, header_of, read_pose_rows
from ingest.formats.text_table import floats, logs, only_log
from ingest.session import CaptureSession

NAME = "AnySense"
FILES = "AR_Pose_<date>.txt, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; times are those of writing, not of the frames"
_COLUMNS = Columns((0, 5, 6, 7, 1, 2, 3, 4), 8, ",", second=1e-3, scale=1.0)
STAMP = '"<'
"""What a stamp begins with."""


def detect(path: Path) -> bool:
    """Whether the file, or a .txt file of the folder, has a stamp in quotes and seven numbers."""
    return bool(logs(path, ("*.txt",), _is_log))


def read(path: Path) -> CaptureSession:
    """Read a pose file, or a folder that holds exactly one; a header may name another order."""
    log = only_log(path, logs(path, ("*.txt",), _is_log))
    rows = read_pose_rows(log, _COLUMNS)
    T = poses_from_quaternions(rows.positions, rows.xyzw, rows.place)
    check_poses(rows.clock.times, T, log, rows.place)
    return CaptureSession(app=NAME, source=path, times=rows.clock.times, T_world_phone=T)


def _is_log(file: Path) -> bool:
    fields = first_pose(file, header_of(file)).split(",")
    stamps = [field.strip() for field in fields if field.strip().startswith(STAMP)]
    others = [field for field in fields if not field.strip().startswith(STAMP)]
    return (
        len(stamps) == 1
        and stamps[0].endswith('>"')
        and stamps[0][2:-2].isdigit()
        and len(floats(others)) == _COLUMNS.width - 1
    )
