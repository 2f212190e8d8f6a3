"""Pinhole cameras and where to put them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in the world.

    Axes are those of OpenGL and ARKit: x right, y up, z toward the viewer, so it looks along -z.
    Pixels are those of OpenCV: (0, 0) is the *centre* of the top left pixel, u right, v down.
    """

    T_world_camera: Float[np.ndarray, "4 4"]
    """Maps camera points into the world, metres."""
    fx: float
    fy: float
    cx: float
    cy: float

    def project(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Pixel u, v and depth in metres of world points (depth <= 0: behind the camera)."""
        R, eye = self.T_world_camera[:3, :3], self.T_world_camera[:3, 3]
        seen = (points - eye) @ R
        depth = -seen[..., 2]
        u = self.cx + self.fx * seen[..., 0] / depth
        v = self.cy - self.fy * seen[..., 1] / depth
        return np.stack([u, v, depth], axis=-1)


def pinhole(
    T_world_camera: Float[np.ndarray, "4 4"], fov_y: float, width: int, height: int
) -> Camera:
    """A camera with square pixels looking through the middle of the picture; `fov_y` in radians."""
    f = 0.5 * height / np.tan(0.5 * fov_y)
    return Camera(T_world_camera, f, f, 0.5 * (width - 1), 0.5 * (height - 1))


def quarter_turns(T_world_camera: Float[np.ndarray, "frames 4 4"]) -> int:
    """Counter-clockwise quarter turns of the pictures (`np.rot90`) that bring up mostly to the top."""
    right, up = T_world_camera[:, 2, :2].sum(axis=0)
    return round(np.arctan2(right, up) / (np.pi / 2)) % 4


def look_at(
    eye: Float[np.ndarray, " 3"], target: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "4 4"]:
    """T_world_camera of a camera at `eye` looking at `target` with a level horizon (world z up)."""
    back = np.asarray(eye, float) - target
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    if np.linalg.norm(right) < 1e-6:  # straight down or up: any right will do
        right, back = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, np.sign(back[2])])
    right = right / np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    T[:3, 3] = eye
    return T


def orbit(
    target: Float[np.ndarray, " 3"], distance: float, azimuth: float, elevation: float
) -> Float[np.ndarray, "4 4"]:
    """T_world_camera seen from `azimuth` (from +x, counter-clockwise) and `elevation`, radians."""
    level = np.cos(elevation)
    away = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    return look_at(target + distance * away, target)
