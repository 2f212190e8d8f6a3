"""ARKit's world (y up) and ours (z up); ARKit's camera and OpenCV's."""

import numpy as np

T_ZUP_ARKIT = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""Maps (x, y, z) to (x, -z, y): ARKit's y becomes z, the origin stays."""

T_OPENCV_ARKIT_CAMERA = np.diag([1.0, -1.0, -1.0, 1.0])
"""Turns OpenCV's camera axes (y down, z forward) into ARKit's (y up, z back), and ARKit's into OpenCV's."""
