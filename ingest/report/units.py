"""Whether time is in seconds and place in metres, by what phones and people do."""

import numpy as np

from ingest.formats.poses import PERIODS
from ingest.report.check import Check
from ingest.session import CaptureSession

_MILLISECOND = 1e-3
_LENGTH_UNITS = (("centimetres", 1e-2), ("millimetres", 1e-3))
_TOO_FAST, _FAST = 3.0, (0.1, 2.0)
"""m/s: nobody's in the fastest tenth of a take, and what is somebody's."""


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
