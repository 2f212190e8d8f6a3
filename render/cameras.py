"""Pinhole cameras, where to put them, and one that follows a person."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from omomo_core.motion import FPS


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


_BINS = 48
_STRIDE = 10
"""The azimuth is chosen every so many frames, among so many directions."""
_SHOULDER = 0.5
"""How far beside straight behind, radians: the object is seen past the person."""
_MAX_STEP = 2
"""Most bins the azimuth turns per stride: 45 degrees a second."""


@dataclass(frozen=True)
class FollowStyle:
    """How the camera follows."""

    elevation: float = 0.26
    """Above the subject, radians."""
    fov_y: float = 0.55
    """Vertical field of view, radians."""
    fill: float = 0.86
    """Share of the picture's width and height the subject may fill."""
    three_quarter: float = 0.75
    """Preferred angle between the person's facing and the camera, to either side, radians."""
    turn_cost: float = 0.35
    """Cost of turning one bin in a stride; more keeps the camera calmer."""


def follow(
    subject: Float[np.ndarray, "frames points 3"],
    person: Float[np.ndarray, "frames 2"],
    facing: Float[np.ndarray, "frames 2"],
    object_track: Float[np.ndarray, "frames 2"],
    width: int,
    height: int,
    style: FollowStyle = FollowStyle(),
) -> list[Camera]:
    """One camera per frame.

    Args:
        subject: points that have to stay in the picture, world, metres.
        person: where the person stands, world x y.
        facing: where they face, world x y, any length.
        held: where the object is, world x y.
        width, height: of the pictures, pixels.
        style: how to follow.
    """
    return framed(
        subject, follow_azimuth(person, facing, object_track, style), width, height, style
    )


def framed(
    subject: Float[np.ndarray, "frames points 3"],
    azimuth: Float[np.ndarray, " frames"],
    width: int,
    height: int,
    style: FollowStyle = FollowStyle(),
) -> list[Camera]:
    """Cameras that see the whole subject from these sides (counter-clockwise from +x, radians)."""
    target = _smooth(0.5 * (subject.min(axis=1) + subject.max(axis=1)), seconds=0.8)
    frame = np.stack([orbit(np.zeros(3), 1.0, float(a), style.elevation) for a in azimuth])
    distance = _distance(subject - target[:, None], frame[:, :3, :3], width, height, style)
    poses = (
        orbit(t, float(d), float(a), style.elevation)
        for t, d, a in zip(target, distance, azimuth, strict=True)
    )
    return [pinhole(T, style.fov_y, width, height) for T in poses]


def behind(facing: Float[np.ndarray, "frames 2"]) -> Float[np.ndarray, " frames"]:
    """Azimuth of a camera that walks behind a person, a little to their right, radians, continuous."""
    way = _smooth(facing / np.maximum(np.linalg.norm(facing, axis=1), 1e-6)[:, None], seconds=0.8)
    ahead = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    return ahead + np.pi + _SHOULDER


def follow_azimuth(
    person: Float[np.ndarray, "frames 2"],
    facing: Float[np.ndarray, "frames 2"],
    object_track: Float[np.ndarray, "frames 2"],
    style: FollowStyle = FollowStyle(),
) -> Float[np.ndarray, " frames"]:
    """Azimuth of the camera per frame, radians, continuous: best views joined by least turning."""
    facing = _smooth(
        facing / np.maximum(np.linalg.norm(facing, axis=1), 1e-6)[:, None], seconds=0.5
    )
    frames = len(facing)
    at = np.minimum(np.arange(0, frames + _STRIDE, _STRIDE), frames - 1)
    cost = _view_cost(facing[at], (object_track - person)[at], style)
    chosen = np.unwrap(_cheapest_path(cost, style.turn_cost) * 2.0 * np.pi / _BINS)
    every = np.interp(np.arange(frames), np.arange(len(at)) * _STRIDE, chosen)
    return _smooth(every[:, None], seconds=0.8)[:, 0]


def _view_cost(
    facing: Float[np.ndarray, "stops 2"],
    toward: Float[np.ndarray, "stops 2"],
    style: FollowStyle,
) -> Float[np.ndarray, "stops bins"]:
    """Return how bad each azimuth is: far from three-quarter front, or the object behind the person."""
    bins = np.arange(_BINS) * 2.0 * np.pi / _BINS
    view = np.stack([np.cos(bins), np.sin(bins)])
    ahead = np.arctan2(facing[:, 1], facing[:, 0])[:, None]
    off_front = np.abs((bins - ahead + np.pi) % (2.0 * np.pi) - np.pi)
    cost = (off_front - style.three_quarter) ** 2
    reach = np.linalg.norm(toward, axis=1, keepdims=True)
    behind = np.maximum(-(toward / np.maximum(reach, 1e-6)) @ view, 0.0)
    return cost + 1.5 * behind**2 * np.minimum(reach / 0.5, 1.0)


def _cheapest_path(
    cost: Float[np.ndarray, "stops bins"], turn_cost: float
) -> Int[np.ndarray, " stops"]:
    """Bins of least summed cost whose neighbours differ by at most _MAX_STEP (Viterbi, cyclic)."""
    steps = np.arange(-_MAX_STEP, _MAX_STEP + 1)
    total, came = cost[0], np.zeros(cost.shape, int)
    for stop in range(1, len(cost)):
        options = np.stack([np.roll(total, s) + turn_cost * s * s for s in steps])
        best = options.argmin(axis=0)
        came[stop] = (np.arange(_BINS) - steps[best]) % _BINS
        total = options.min(axis=0) + cost[stop]
    path = [int(total.argmin())]
    for stop in range(len(cost) - 1, 0, -1):
        path.append(int(came[stop, path[-1]]))
    return np.array(path[::-1])


def _distance(
    offset: Float[np.ndarray, "frames points 3"],
    R_world_camera: Float[np.ndarray, "frames 3 3"],
    width: int,
    height: int,
    style: FollowStyle,
) -> Float[np.ndarray, " frames"]:
    """Return how far the camera stands from the target so that every point is in the picture."""
    seen = offset @ R_world_camera
    tall = np.tan(0.5 * style.fov_y) * style.fill
    wide = tall * width / height
    needed = np.maximum(np.abs(seen[..., 0]) / wide, np.abs(seen[..., 1]) / tall) + seen[..., 2]
    # The mean over a window of maxima over that window never falls below what a frame needs.
    window = int(1.5 * FPS)
    widest = maximum_filter1d(needed.max(axis=1), 2 * window + 1, mode="nearest")
    return gaussian_filter1d(widest, window / 3.0, radius=window, mode="nearest")


def _smooth(
    values: Float[np.ndarray, "frames axes"], seconds: float
) -> Float[np.ndarray, "frames axes"]:
    return gaussian_filter1d(values.astype(float), seconds * FPS, axis=0, mode="nearest")
