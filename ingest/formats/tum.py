"""TUM trajectories: lines `t tx ty tz qx qy qz qw` in seconds and metres, # comments, poses only.

Any program may write them and none says which way its axes point. Read here as camera poses with
OpenCV's axes (x right, y down, z forward in the landscape image) in a world whose y or z is up; since
nothing vouches for either, both stay open until the object is known. Comment lines `# axes: arkit` (or
opencv) and `# up: y` (or z) state them. Ours are written with them.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.formats.axes import T_OPENCV_ARKIT_CAMERA, opencv_poses, session_of_poses
from ingest.formats.columns import named_columns
from ingest.formats.pick import first_row, floats, logs, only_log
from ingest.formats.table import numbers, read_rows
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


def write(session: CaptureSession, folder: Path) -> Path:
    """Write trajectory.txt with OpenCV axes and, if it is known, z up, and say so; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    aligned = opencv_poses(session.T_world_phone)
    T = aligned if session.gravity_aligned else session.T_world_phone @ T_OPENCV_ARKIT_CAMERA
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True)
    rows = np.concatenate([session.times[:, None], T[:, :3, 3], quaternions], axis=1)
    comments = ["# timestamp tx ty tz qx qy qz qw", "# axes: opencv"]
    comments += ["# up: z"] if session.gravity_aligned else []
    lines = [" ".join(f"{x:.9f}" for x in row) for row in rows]
    text = "\n".join([*comments, *lines, ""])
    (folder / "trajectory.txt").write_text(text, encoding="utf-8")
    return folder


def _is_log(file: Path) -> bool:
    row = floats(first_row(file).split())
    if len(row) != _WIDTH or abs(np.linalg.norm(np.clip(row[4:], -9, 9)) - 1) > 0.1:
        return False
    named = named_columns(file)
    return named is None or named.places == tuple(range(_WIDTH))
