"""Checks of units, duration and rate of the poses."""

import numpy as np

from ingest.formats.poses import PERIODS
from ingest.report.check import Check, grade, graded
from ingest.report.look import USEFUL_SECONDS
from ingest.session import CaptureSession

_LONG_SECONDS = 1800.0
_WARN_PERIOD, _BAD_PERIOD = 0.04, 0.09
"""Seconds between poses: under 25 Hz is coarse, at 10 Hz every step is a gap."""
_SHORTEST_PERIOD = 1 / 75
"""ARKit gives at most 60 poses a second."""
_DROP_WINDOW, _DROP = 61, 1.6
"""Steps over which the rate is taken, and the factor by which a hot phone slows (60 to 30)."""
_MILLISECOND = 1e-3
_LENGTH_UNITS = (("centimetres", 1e-2), ("millimetres", 1e-3))
_TOO_FAST, _FAST = 3.0, (0.1, 2.0)
"""m/s at the 90th percentile of a take: more than anybody moves, and the usual range."""


def duration(session: CaptureSession) -> Check:
    """Check of the length of the take."""
    seconds = float(session.times[-1] - session.times[0])
    message = f"{seconds:.1f} s, {len(session.times)} poses"
    if seconds > _LONG_SECONDS:
        return Check("duration", "warn", message, fix="Give one take, not a whole session.")
    severity = "ok" if seconds >= USEFUL_SECONDS else "warn"
    return graded("duration", severity, message, "Record at least three seconds.")


def rate(session: CaptureSession) -> Check:
    """Poses a second, and how evenly they come."""
    steps = np.diff(session.times)
    period = float(np.median(steps))
    uneven = float(np.mean(np.abs(steps - period) > 0.2 * period))
    message = (
        f"{1 / period:.1f} poses a second; {uneven:.1%} of the steps are uneven, "
        f"the longest is {1000 * steps.max():.0f} ms"
    )
    if period < _SHORTEST_PERIOD:
        fix = "ARKit gives at most 60: give the log as the app wrote it, not resampled or sped up."
        return Check("rate", "warn", message, fix=fix)
    severity = grade(period, _WARN_PERIOD, _BAD_PERIOD)
    fix = "Set the app to 30 or 60 poses a second; cool the phone."
    return graded("rate", severity, message, fix)


def steadiness(session: CaptureSession) -> Check:
    """Whether the rate stays: a hot phone falls from 60 to 30 poses a second, or fewer."""
    steps = np.diff(session.times)
    width = min(_DROP_WINDOW, len(steps))
    windows = np.lib.stride_tricks.sliding_window_view(steps, width)
    periods = np.median(windows, axis=1)
    slow = np.flatnonzero(periods > _DROP * np.median(periods[: max(1, len(periods) // 10)]))
    if not len(slow):
        return Check("steady rate", "ok", "the rate stays the same")
    first = int(slow[0]) + width // 2
    before, after = 1 / periods[0], 1 / float(np.median(periods[slow]))
    when = session.times[first] - session.times[0]
    return Check(
        "steady rate",
        "warn",
        f"from {before:.0f} to {after:.0f} poses a second at {when:.1f} s",
        (first, min(int(slow[-1]) + width, len(steps)) + 1),
        "The phone ran hot: let it cool, and record without the depth map or the screen's light.",
    )


def units(session: CaptureSession) -> Check:
    """Names another unit when stamps or positions make sense in it, and none in the right one."""
    steps = np.diff(session.times)
    period = float(np.median(steps))
    # Finer units make hours of a take, which the readers refuse.
    if period > 1 and PERIODS[0] < period * _MILLISECOND < PERIODS[1]:
        message = f"stamps {period:.3g} s apart look like milliseconds"
        return _wrong(message, "Give the stamps in seconds", _MILLISECOND)
    if (steps == 1).all():
        fix = "Give the time of each pose in seconds, not its number."
        return Check("units", "bad", "the stamps count the poses: 1, 2, 3", fix=fix)
    moved = np.linalg.norm(np.diff(session.T_world_phone[:, :3, 3], axis=0), axis=1)
    fast = float(np.percentile(moved / steps, 90))
    for name, unit in _LENGTH_UNITS:
        if fast > _TOO_FAST and _FAST[0] < fast * unit < _FAST[1]:
            return _wrong(
                f"a phone at {fast:.3g} m/s looks like {name}", "Give the positions in metres", unit
            )
    return Check("units", "ok", "seconds and metres")


def _wrong(message: str, do: str, unit: float) -> Check:
    return Check("units", "bad", message, fix=f"{do}: multiply them by {unit:g}.")
