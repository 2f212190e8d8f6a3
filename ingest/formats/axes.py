"""Which way cameras and worlds point: what comments state, and from other axes to ARKit's."""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.pick import head_lines
from ingest.trajectory.axes import T_ZUP_ARKIT
from omomo_core.errors import InputError

T_OPENCV_ARKIT_CAMERA = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenCV's camera (y down, z forward) and ARKit's (y up, z back) turn into each other."""

T_ARKIT_ZUP = T_ZUP_ARKIT.T
"""Maps (x, y, z) to (x, z, -y): the z axis of a world that is z up becomes ARKit's y."""

CAMERAS = {"arkit": np.eye(4), "opencv": T_OPENCV_ARKIT_CAMERA}
"""What a stated camera is turned by, from the right."""
WORLDS = {"y": np.eye(4), "z": T_ARKIT_ZUP}
"""What a world whose up is stated is turned by, from the left."""

_STATED = re.compile(r"\s*#\s*(axes|up)\s*:\s*(.*?)\s*$")


def arkit_poses(
    T_zup_opencv: Float64[np.ndarray, "frames 4 4"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """T_world_phone from camera-to-world poses with OpenCV camera axes in a world that is z up."""
    return T_ARKIT_ZUP @ T_zup_opencv @ T_OPENCV_ARKIT_CAMERA


def opencv_poses(
    T_world_phone: Float64[np.ndarray, "frames 4 4"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """The inverse of `arkit_poses`."""
    return T_ZUP_ARKIT @ T_world_phone @ T_OPENCV_ARKIT_CAMERA


def stated_axes(log: Path) -> dict[str, str]:
    """What comment lines at the top state about `axes` (of the camera) and `up` (in the world).

    Raises:
        InputError: "axes-unknown" for a comment that states other axes.
    """
    known = {"axes": tuple(CAMERAS), "up": tuple(WORLDS)}
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
