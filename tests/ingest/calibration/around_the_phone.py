"""Cameras of a person who walks round a clamped phone."""

import numpy as np
from scipy.spatial.transform import Rotation


def cameras(rng: np.random.Generator, count: int) -> np.ndarray:
    """T_screen_camera of a person walking round the phone, looking at it."""
    poses = []
    for _ in range(count):
        slant, round_ = rng.uniform(0.35, 0.9), rng.uniform(0, 2 * np.pi)
        away = Rotation.from_euler("xz", [slant, round_]).as_matrix() @ [0, 0, -1]
        T = np.eye(4)
        T[:3, 2] = -away
        T[:3, 0] = np.cross([0.1, 1, 0], T[:3, 2])
        T[:3, 0] /= np.linalg.norm(T[:3, 0])
        T[:3, 1] = np.cross(T[:3, 2], T[:3, 0])
        T[:3, 3] = 0.45 * rng.uniform(0.8, 1.3) * away + rng.normal(size=3) * 0.01
        poses.append(T)
    return np.array(poses)
