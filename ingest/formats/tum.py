"""TUM trajectories: lines `t tx ty tz qx qy qz qw` in seconds and metres, # comments, poses only.

Any program may write them and none says which way its axes point. Read here as camera poses with
OpenCV's axes (x right, y down, z forward in the landscape image) in a world that is z up; since
nothing vouches for that, such a session is not gravity aligned. Comment lines `# axes: arkit` (or
opencv) and `# up: y` (or z) state it, and then it is. Ours are written with them.
"""

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.formats.axes import T_ARKIT_ZUP, T_OPENCV_ARKIT_CAMERA, opencv_poses
from ingest.formats.pick import first_row, floats, head_lines, logs, only_log
from ingest.formats.poses import check_poses, poses_from_quaternions
from ingest.formats.table import numbers, read_rows
from ingest.session import CaptureSession
from omomo_core.errors import InputError

NAME = "TUM"
FILES = "a trajectory of `t tx ty tz qx qy qz qw`, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; which way is up only if a comment says so"

_WIDTH = 8
_PATTERNS = ("*.txt", "*.tum")
_T_CAMERA_ARKIT = {"arkit": np.eye(4), "opencv": T_OPENCV_ARKIT_CAMERA}
_T_ARKIT_WORLD = {"y": np.eye(4), "z": T_ARKIT_ZUP}
_STATED = re.compile(r"\s*#\s*(axes|up)\s*:\s*(.*?)\s*$")


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
    times = table.values[:, 0]
    T_world_camera = poses_from_quaternions(table.values[:, 1:4], table.values[:, 4:], table.place)
    stated = _stated(log)
    T_arkit_world = _T_ARKIT_WORLD[stated.get("up", "z")]
    T = T_arkit_world @ T_world_camera @ _T_CAMERA_ARKIT[stated.get("axes", "opencv")]
    check_poses(times, T, log, table.place)
    return CaptureSession(
        app=NAME, source=path, times=times, T_world_phone=T, gravity_aligned="up" in stated
    )


def write(session: CaptureSession, folder: Path) -> Path:
    """Write trajectory.txt with OpenCV axes, z up, and say so; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    T = opencv_poses(session.T_world_phone)
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
    return len(row) == _WIDTH and not abs(np.linalg.norm(np.clip(row[4:], -9, 9)) - 1) > 0.1


def _stated(log: Path) -> dict[str, str]:
    """What the comments at the top say about `axes` and `up`."""
    known = {"axes": tuple(_T_CAMERA_ARKIT), "up": tuple(_T_ARKIT_WORLD)}
    stated: dict[str, str] = {}
    for number, line in enumerate(head_lines(log), start=1):
        if (match := _STATED.match(line)) is None:
            continue
        key, value = match[1], match[2].lower()
        if value not in known[key]:
            raise InputError(
                "axes-unknown",
                f"The comment states {key}: {value[:30]}; known are {' and '.join(known[key])}.",
                where=f"{log}:{number}",
                fix="Turn the trajectory into these axes, and state them.",
            )
        stated[key] = value
    return stated
