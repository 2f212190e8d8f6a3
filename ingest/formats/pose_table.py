"""CSV tables of poses whose header names the columns.

Comment lines `# axes: arkit` (or opencv) and `# up: y` (or z) state the camera's axes and the up axis of the
world. Without them a table is read with ARKit's camera axes, and both are decided once the object is known.
A table of eight columns without a header is ambiguous: ios_logger writes the quaternion w first.
"""

from dataclasses import replace
from pathlib import Path

from ingest.formats.anysense import STAMP
from ingest.formats.camera_poses import poses_from_quaternions, session_of_poses
from ingest.formats.pose_columns import (
    IN_ORDER,
    Columns,
    first_pose,
    header_of,
    is_in_order,
    read_pose_rows,
)
from ingest.formats.text_table import first_row, floats, logs, only_log
from ingest.session import CaptureSession

NAME = "CSV poses"
FILES = "a table whose header names a time, x, y, z, qx, qy, qz and qw, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; axes and up only if comments say so"

_PATTERNS = ("*.csv", "*.txt", "*.tum")
_OF_APPS = ({"timestamp", "frame"}, {"status"})
"""Columns of Stray Scanner and ScanCapture."""
_HEADERLESS = replace(IN_ORDER, separator=",")


def detect(path: Path) -> bool:
    """Whether the file (or one in the folder) names such columns, or holds eight comma-separated numbers."""
    if path.is_dir():
        return bool(logs(path, _PATTERNS, _is_table))
    return _is_table(path) or _is_headerless(path)


def read(path: Path) -> CaptureSession:
    """Read a table, or a folder that holds exactly one; without a header t, x, y, z, qx, qy, qz, qw."""
    return read_table(
        NAME, path, only_log(path, logs(path, _PATTERNS, _is_table)), _HEADERLESS, "arkit"
    )


def read_table(name: str, path: Path, log: Path, columns: Columns, axes: str) -> CaptureSession:
    """The session of a table of poses.

    Args:
        name: of the format.
        path: what the user gave.
        log: the table.
        columns: those that it has where no header names them.
        axes: as for `session_of_poses`.
    """
    rows = read_pose_rows(log, columns)
    T = poses_from_quaternions(rows.positions, rows.xyzw, rows.place)
    session = session_of_poses(name, path, log, T, rows.clock.times, axes, rows.place)
    return replace(session, notes=rows.clock.notes)


def _is_table(file: Path) -> bool:
    """Whether a header names a pose's columns, and no app's of which more is known."""
    header = header_of(file)
    if header is None or file.name == "ARposes.txt" or is_in_order(file):
        return False
    if STAMP in first_pose(file, header):
        return False
    return not any(names <= header.names for names in _OF_APPS)


def _is_headerless(file: Path) -> bool:
    row = floats(first_row(file).split(","))
    return len(row) == _HEADERLESS.width and file.name != "ARposes.txt" and header_of(file) is None
