"""TUM trajectories: lines `t tx ty tz qx qy qz qw` in seconds and metres, # comments, poses only.

Any program may write them and none says which way its axes point. Read here as camera poses with
OpenCV's axes (x right, y down, z forward in the landscape image) in a world whose y or z is up; since
nothing vouches for either, both stay open until the object is known. Comment lines `# axes: arkit` (or
opencv) and `# up: y` (or z) state them. Ours are written with them.
"""

from pathlib import Path

import numpy as np

from ingest.formats.camera_poses import session_of_poses
from ingest.formats.text_table import (
    first_row,
    floats,
    logs,
    named_columns,
    numbers,
    only_log,
    read_rows,
)
from ingest.session import CaptureSession

NAME = "TUM"
FILES = "a trajectory of `t tx ty tz qx qy qz qw`, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; axes and up only if comments say so"

_WIDTH = 8
_PATTERNS = ("*.txt", "*.tum")


def detect(path: Path) -> bool:
    """Whether the file, or a .txt or .tum file of the folder, has eight numbers between blanks.

    The last four must be about a unit quaternion, or the first line is no pose.
    """
    return bool(logs(path, _PATTERNS, _is_log))


def read(path: Path) -> CaptureSession:
    """Read a trajectory file, or a folder that holds exactly one.

    Raises:
        InputError: "axes-unknown" for a comment that states other axes than those above; besides
            what every log is checked for.
    """
    log = only_log(path, logs(path, _PATTERNS, _is_log))
    table = numbers(read_rows(log, None), _WIDTH, range(_WIDTH))
    return session_of_poses(NAME, path, table, table.values[:, 0], "opencv")


def _is_log(file: Path) -> bool:
    row = floats(first_row(file).split())
    if len(row) != _WIDTH or abs(np.linalg.norm(np.clip(row[4:], -9, 9)) - 1) > 0.1:
        return False
    named = named_columns(file)
    return named is None or named.places == tuple(range(_WIDTH))
