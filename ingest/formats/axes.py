"""Poses of other cameras and worlds in ARKit's axes; what a log states about its own."""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.axes import T_OPENCV_ARKIT_CAMERA, T_ZUP_ARKIT
from ingest.formats.pick import head_lines
from ingest.formats.poses import check_poses, poses_from_quaternions
from ingest.formats.table import NumberTable
from ingest.session import CaptureSession
from omomo_core.errors import InputError

T_ARKIT_ZUP = T_ZUP_ARKIT.T
"""Maps (x, y, z) to (x, z, -y): the z axis of a world that is z up becomes ARKit's y."""

_CAMERAS = {"arkit": np.eye(4), "opencv": T_OPENCV_ARKIT_CAMERA}
"""What turns the axes of a stated camera into ARKit's (multiplied from the right)."""
_WORLDS = {"y": np.eye(4), "z": T_ARKIT_ZUP}
"""What turns a world whose up axis is stated into ARKit's (multiplied from the left)."""

_STATED = re.compile(r"\s*#\s*(axes|up)\s*:\s*(.*?)\s*$")


def arkit_poses(
    T_zup_opencv: Float64[np.ndarray, "frames 4 4"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """T_world_phone from camera-to-world poses with OpenCV camera axes in a world that is z up."""
    return T_ARKIT_ZUP @ T_zup_opencv @ T_OPENCV_ARKIT_CAMERA


def opencv_poses(
    T_world_phone: Float64[np.ndarray, "frames 4 4"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses with ARKit's camera axes as poses with OpenCV's; inverse of `arkit_poses`."""
    return T_ZUP_ARKIT @ T_world_phone @ T_OPENCV_ARKIT_CAMERA


def session_of_poses(
    app: str, path: Path, table: NumberTable, times: Float64[np.ndarray, " frames"], usual: str
) -> CaptureSession:
    """The session of a log that holds camera poses alone, in axes that it may state in comments.

    Without a statement about `up` the world stays the log's own, because that is the world in which a user
    gives --up. Without one about `axes` the camera is read with the usual ones and left open.

    Args:
        app: name of the format.
        path: what the user gave.
        table: columns 1 to 7 are x, y, z (metres) and qx, qy, qz, qw, camera to world.
        times: of its rows, seconds.
        usual: the camera's axes where the log states none, "arkit" or "opencv".

    Raises:
        InputError: "axes-unknown" for a comment that states other axes; and what every log is checked for.
    """
    stated = _stated_axes(table.path)
    T_world_camera = poses_from_quaternions(table.values[:, 1:4], table.values[:, 4:], table.place)
    T = _WORLDS[stated.get("up", "y")] @ T_world_camera @ _CAMERAS[stated.get("axes", usual)]
    check_poses(times, T, table.path, table.place)
    return CaptureSession(
        app=app,
        source=path,
        times=times,
        T_world_phone=T,
        gravity_aligned="up" in stated,
        world_axes=True,
        camera_open="axes" not in stated,
    )


def _stated_axes(log: Path) -> dict[str, str]:
    """The words of the comment lines `# axes: arkit` and `# up: y` at the top of a log, if there are any.

    Raises:
        InputError: "axes-unknown" for a comment that states other axes.
    """
    known = {"axes": tuple(_CAMERAS), "up": tuple(_WORLDS)}
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
