"""Cameras around a thing that is nothing but sparse points, for the stages that need no picture."""

from pathlib import Path

import numpy as np

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.scan.scan_types import Registered, Scale, View
from render.cameras import orbit

SIZE = (640, 480)
K = np.array([480.0, 480.0, 319.5, 239.5])


def ring(target, count=24, distance=1.4, elevations=(0.2, 0.6), turn=2 * np.pi):
    """T_world_camera (OpenCV's axes) of cameras that look at a target from all around."""
    poses = [
        orbit(
            np.asarray(target, float), distance, turn * k / count, elevations[k % len(elevations)]
        )
        for k in range(count)
    ]
    return np.stack(poses) @ T_OPENCV_ARKIT_CAMERA


def registered(poses, points, up="arkit"):
    """These cameras and points, without pictures."""
    views = tuple(View(f"{k}.png", Path(f"{k}.png"), SIZE, K, T) for k, T in enumerate(poses))
    return Registered(
        views=views,
        points=points,
        colours=np.zeros((len(points), 3), np.uint8),
        observed=np.zeros((0, 2), np.int64),
        reprojection=0.5,
        scale=Scale(0.003, "arkit", "the phone's poses"),
        up=up,
        left_out=(),
        notes=(),
        model=Path(),
        images=Path(),
    )


def floor_points(rng, half=2.5, count=3000):
    """Of a floor at z = 0, measured to 2 mm."""
    return np.column_stack([rng.uniform(-half, half, (count, 2)), rng.normal(0, 0.002, count)])


def box_points(rng, low, high, count=600):
    """On the sides and the top of a box."""
    points = rng.uniform(low, high, (count, 3))
    side = rng.integers(0, 5, count)
    for k, (axis, end) in enumerate([(0, low), (0, high), (1, low), (1, high), (2, high)]):
        points[side == k, axis] = end[axis]
    return points


def wall_points(rng, count=1500):
    """Of two walls of a room."""
    along, height = rng.uniform(-2.5, 2.5, count), rng.uniform(0, 2.5, count)
    half = count // 2
    return np.concatenate(
        [
            np.column_stack([along[:half], np.full(half, 2.4), height[:half]]),
            np.column_stack([np.full(count - half, -2.4), along[half:], height[half:]]),
        ]
    )
