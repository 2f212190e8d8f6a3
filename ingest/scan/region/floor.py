"""find_floor: the plane that the object stands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.report.check import Check
from ingest.scan.region.aim import Aim
from ingest.scan.types import Registered
from ingest.trajectory.plane import Plane, fit_plane

_NEAR = 0.7
"""Of the way from the cameras to the aim: points farther from it are of other things."""
_TILT = np.radians(6)
"""Between gravity and the normal of a floor."""
_GUESSED_TILT = np.radians(30)
"""The same where up is only a guess."""
_WIDE = 0.35
"""Of the way from the cameras: a floor has points farther from the aim than that, in most directions."""
_SECTORS = 8
_TRIALS = 4
"""Planes that are looked at."""
_THICK = 0.02
_ABOVE_AIM = 0.05
_THINNEST = 0.002
"""Metres; no sparse points lie better in a plane than that."""
_ROUNDS = 6
_LOWEST = 2.0
"""Percentile of the heights that stands in for a floor that has no detail."""


@dataclass(frozen=True)
class ScanFloor:
    """The floor under the aim."""

    T_world_floor: Float64[np.ndarray, "4 4"]
    """z is its normal; the origin is below the aim."""
    noise: float
    """How far its points lie from it, metres (robust standard deviation)."""
    note: Check


def find_floor(registered: Registered, aim: Aim) -> ScanFloor:
    """The largest level plane near the aim and below it, or the lowest points where there is none."""
    away = np.linalg.norm((registered.points - aim.point)[:, :2], axis=1)
    below = registered.points[:, 2] < aim.point[2] + _ABOVE_AIM
    near = registered.points[(away < _NEAR * aim.distance) & below]
    guessed = registered.up in ("cameras", "floor")
    plane = _widest(near, aim, _GUESSED_TILT if guessed else _TILT)
    if plane is None:
        return _lowest(near if len(near) else registered.points, aim)
    normal, height, noise = _tightened(near, plane.normal, plane.offset)
    message = f"The floor lies within {1e3 * noise:.0f} mm of its points."
    return ScanFloor(floor_frame(normal, height, aim.point), noise, Check("floor", "ok", message))


def _widest(points: Float64[np.ndarray, "points 3"], aim: Aim, max_tilt: float) -> Plane | None:
    """The largest level plane that goes on around the aim, as a floor does and no seat of a chair."""
    for _ in range(_TRIALS):
        plane = fit_plane(points, np.array([0.0, 0.0, 1.0]), max_tilt)
        if plane is None:
            break
        on = np.abs(points @ plane.normal - plane.offset) < _THICK
        x, y = (points[on] - aim.point)[:, :2].T
        far = np.hypot(x, y) > _WIDE * aim.distance
        sectors = np.floor(np.arctan2(y[far], x[far]) / (2 * np.pi) * _SECTORS)
        if len(np.unique(sectors)) > _SECTORS / 2:
            return plane
        points = points[~on]
    return None


def _lowest(points: Float64[np.ndarray, "points 3"], aim: Aim) -> ScanFloor:
    height = float(np.percentile(points[:, 2], _LOWEST)) if len(points) else 0.0
    note = Check(
        "floor",
        "warn",
        "No floor was found, so the lowest points stand in for it.",
        fix="Film the floor around the object too; lay something with a pattern on a plain one.",
    )
    return ScanFloor(floor_frame(np.array([0.0, 0.0, 1.0]), height, aim.point), 0.01, note)


def _tightened(
    points: Float64[np.ndarray, "points 3"], normal: Float64[np.ndarray, "3"], offset: float
) -> tuple[Float64[np.ndarray, "3"], float, float]:
    """The plane fitted to the points that lie in it as closely as most do: also their noise."""
    noise = _THINNEST
    for _ in range(_ROUNDS):
        beyond = points @ normal - offset
        close = beyond[np.abs(beyond) < _THICK]
        noise = max(1.4826 * float(np.median(np.abs(close))), _THINNEST)
        on = points[np.abs(beyond) < 2.5 * noise]
        centre = on.mean(axis=0)
        # A plane has one direction with no spread; its sign is the old one's.
        fitted = np.linalg.eigh((on - centre).T @ (on - centre))[1][:, 0]
        normal = fitted * np.sign(fitted @ normal)
        offset = float(normal @ centre)
    return normal, offset, noise


def floor_frame(
    normal: Float64[np.ndarray, "3"], offset: float, point: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "4 4"]:
    """T_world_floor with x as near to the world's as can be."""
    x = np.array([1.0, 0.0, 0.0])
    x = x - (x @ normal) * normal
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    # Below the point along the world's up, which a tilted normal is not.
    T[:3, 3] = point + np.array([0.0, 0.0, (offset - normal @ point) / normal[2]])
    return T
