"""CSV tables of poses whose header names the columns.

Comment lines `# axes: arkit` (or opencv) and `# up: y` (or z) state the camera's axes and the up axis of the
world. Without them a table is read with ARKit's camera axes, and both are decided once the object is known.
A table of eight columns without a header is ambiguous: ios_logger writes the quaternion w first.
"""

from pathlib import Path

from ingest.formats.camera_poses import session_of_poses
from ingest.formats.text_table import (
    Columns,
    first_row,
    floats,
    logs,
    named_columns,
    numbers,
    only_log,
    read_rows,
)
from ingest.session import CaptureSession

NAME = "CSV poses"
FILES = "a CSV table whose header names a time, x, y, z, qx, qy, qz and qw, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; axes and up only if comments say so"

_PATTERNS = ("*.csv",)
_OF_APPS = ({"timestamp", "frame", "qw"}, {"timestamp", "status"})
"""Columns of Stray Scanner and ScanCapture."""
_HEADERLESS = Columns(tuple(range(8)), 8, 1.0, ",", commented=True)


def detect(path: Path) -> bool:
    """Whether the file (or one in the folder) names such columns, or holds eight comma-separated numbers."""
    if path.is_dir():
        return bool(logs(path, _PATTERNS, _is_table))
    return _is_table(path) or _is_headerless(path)


def read(path: Path) -> CaptureSession:
    """Read a table, or a folder that holds exactly one; without a header t, x, y, z, qx, qy, qz, qw."""
    log = only_log(path, logs(path, _PATTERNS, _is_table))
    columns = named_columns(log) or _HEADERLESS
    text = read_rows(log, columns.separator)
    rows = text if columns.commented else text.without_header()
    table = numbers(rows, columns.width, columns.places)
    times = table.values[:, 0] * columns.second
    return session_of_poses(NAME, path, table, times, "arkit")


def _is_table(file: Path) -> bool:
    """Whether a header names a pose's columns, and no app's of which more is known."""
    columns = named_columns(file)
    if columns is None or (columns.separator is None and columns.places == tuple(range(8))):
        return False
    return not any(names <= columns.names for names in _OF_APPS)


def _is_headerless(file: Path) -> bool:
    row = floats(first_row(file).split(","))
    return len(row) == _HEADERLESS.width and file.name != "ARposes.txt"
