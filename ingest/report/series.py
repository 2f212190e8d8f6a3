"""TakeSeries: what there is to plot of a take."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.report.gravity import gravity_angles
from ingest.report.look import Look
from ingest.report.stance import bottom
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS

Spans = list[tuple[float, float]]
"""Stretches in seconds from the start of the take."""


@dataclass(frozen=True)
class Curve:
    """A value over time; NaN breaks the line."""

    seconds: Float64[np.ndarray, " samples"]
    """From the start of the take."""
    values: Float64[np.ndarray, " samples"]


@dataclass(frozen=True)
class TakeSeries:
    """Curves over time, a path from above, and the stretches to shade under them."""

    seconds: float
    speed: Curve
    """Of the phone, m/s."""
    phone_height: Curve
    """Metres above the floor, or above the place where the session started."""
    object_height: Curve | None
    """Of the object's lowest point above the floor, metres."""
    path: Float64[np.ndarray, "frames 2"]
    """Of the object (or the phone) from above, metres; NaN breaks the line."""
    gravity: Curve | None
    """Degrees between the accelerometer's mean and the poses' down."""
    steps: Curve
    """Milliseconds from each pose to the next."""
    rests: Spans
    faults: Spans


def take_series(look: Look) -> TakeSeries:
    """What to plot of a take that is looked over."""
    session = look.session
    clock = session.times - session.times[0]
    T, valid = look.poses
    phone = np.where(valid[:, None], T[:, :3, 3], np.nan)
    grid = np.arange(len(T)) / FPS
    take = look.object_take
    place = T if take is None else take.motion.T_world_object
    bottoms = None if take is None else np.where(valid, bottom(take), np.nan)
    speed = np.where(valid, np.linalg.norm(velocity(phone, FPS), axis=1), np.nan)
    return TakeSeries(
        seconds=float(clock[-1]),
        speed=Curve(grid, speed),
        phone_height=Curve(grid, phone[:, 2]),
        object_height=None if bottoms is None else Curve(grid, bottoms),
        path=np.where(valid[:, None], place[:, :2, 3], np.nan),
        gravity=None if session.imu is None else Curve(*gravity_angles(session, look.up)),
        steps=Curve(clock[1:], 1000 * np.diff(clock)),
        rests=[(a / FPS, b / FPS) for a, b in look.rests],
        faults=[(float(clock[a]), float(clock[b])) for a, b in runs(look.breaks.any)],
    )
