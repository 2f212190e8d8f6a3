"""From OpenCV's camera axes and worlds that are z up to the camera and the world of ARKit."""

import numpy as np
from jaxtyping import Float64

from ingest.trajectory.axes import T_ZUP_ARKIT

T_OPENCV_ARKIT_CAMERA = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenCV's camera (y down, z forward) and ARKit's (y up, z back) turn into each other."""

T_ARKIT_ZUP = T_ZUP_ARKIT.T
"""Maps (x, y, z) to (x, z, -y): the z axis of a world that is z up becomes ARKit's y."""


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
