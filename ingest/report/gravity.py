"""Whether the accelerometer, turned by the poses, points down."""

import numpy as np
from jaxtyping import Float64

from ingest.report.check import Check, grade, graded, worst
from ingest.report.look import Look
from ingest.session import GRAVITY, CaptureSession
from ingest.trajectory.accelerometer import measured_up
from ingest.trajectory.config import VERTICAL
from omomo_core.motion import FPS

_WINDOW_NOTED = 12.0
"""Degrees that one window may be off: brisk motion does not average out in two seconds."""
_FIX_AXES = (
    "The log's axes are not the app's usual ones, or its clocks differ: check that the files "
    "belong to one take."
)


def gravity(look: Look) -> Check:
    """Whether up is up, as far as the log tells."""
    session = look.session
    if session.imu is None:
        return _unchecked(look)
    times, angles = gravity_angles(session, look.up)
    if len(times) == 0:
        fix = "Give the accelerometer's log of this take."
        message = "the accelerometer ran too short a time to check the axes"
        return Check("gravity", "warn", message, fix=fix)
    return _direction(
        look, times, angles, float(np.median(np.linalg.norm(session.imu.accel, axis=1)))
    )


def _unchecked(look: Look) -> Check:
    """Most apps log no accelerometer: that is said, and is no fault of a take."""
    session, take = look.session, look.take
    if session.gravity_aligned:
        message = (
            "no accelerometer in the log: the poses' own up, handedness and metres are believed, and "
            "checked only by how the object rests"
        )
        return Check("gravity", "ok", message)
    message = f"{session.app} does not log which way is up, and there is no accelerometer"
    if take is None:
        fix = "Give the object and its mount, so that up can be found where it rests, or give up (--up)."
        return Check("gravity", "warn", message, fix=fix)
    known = "up is as given" if take.up.source == "given" else take.up.note.rstrip(".")
    return Check("gravity", "ok", f"{message}; {known[0].lower()}{known[1:]}")


def _direction(
    look: Look,
    times: Float64[np.ndarray, " windows"],
    angles: Float64[np.ndarray, " windows"],
    size: float,
) -> Check:
    start, stop = look.chosen
    used = angles[(times > start / FPS) & (times < stop / FPS)]
    off, most = float(np.median(used if len(used) else angles)), int(np.argmax(angles))
    if not 0.8 < size / GRAVITY < 1.2:
        fix = "Log the raw accelerometer (gravity included), in g or m/s^2, or leave it out."
        message = f"the accelerometer reads {size:.3g} m/s^2 as a rule instead of {GRAVITY:.2f}"
        return Check("gravity", "bad" if off > VERTICAL.refused else "warn", message, fix=fix)
    severity = worst(
        [
            grade(off, VERTICAL.noted, VERTICAL.refused),
            grade(float(angles[most]), _WINDOW_NOTED, 180.0),
        ]
    )
    logged = look.session.times
    edges = logged[0] + times[most] + np.array([-0.5, 0.5]) * VERTICAL.window
    first, last = np.searchsorted(logged, edges)
    message = (
        f"the accelerometer agrees with the poses' down within {off:.1f} deg (median of "
        f"the stretch that is used; at most {angles[most]:.1f} deg anywhere)"
    )
    place = (int(first), int(last)) if off <= VERTICAL.noted else (0, len(logged))
    return graded("gravity", severity, message, _FIX_AXES, place)


def gravity_angles(
    session: CaptureSession, up: Float64[np.ndarray, "3"]
) -> tuple[Float64[np.ndarray, " windows"], Float64[np.ndarray, " windows"]]:
    """Seconds from the start of the take, and degrees between up and the mean of each window.

    Args:
        session: with an accelerometer, or there are no windows.
        up: unit vector in the session's world.
    """
    measured = measured_up(session)
    angles = np.degrees(np.arccos(np.clip(measured @ up, -1, 1)))
    began = 0.0 if session.imu is None else max(0.0, session.imu.times[0] - session.times[0])
    return began + (np.arange(len(angles)) + 0.5) * VERTICAL.window, angles
