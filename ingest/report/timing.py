"""Duration and rate."""

import numpy as np

from ingest.report.check import Check, grade
from ingest.session import CaptureSession

_SHORT_SECONDS = 3.0
_WARN_PERIOD, _BAD_PERIOD = 0.04, 0.09
"""Seconds between poses: under 25 Hz is coarse, at 10 Hz every step is a gap."""


def duration(session: CaptureSession) -> Check:
    """How long the take is."""
    seconds = float(session.times[-1] - session.times[0])
    return Check(
        "duration",
        "ok" if seconds >= _SHORT_SECONDS else "warn",
        f"{seconds:.1f} s, {len(session.times)} poses",
        fix="" if seconds >= _SHORT_SECONDS else "Record at least three seconds.",
    )


def rate(session: CaptureSession) -> Check:
    """Poses a second, and how evenly they come."""
    steps = np.diff(session.times)
    period = float(np.median(steps))
    uneven = float(np.mean(np.abs(steps - period) > 0.2 * period))
    severity = grade(period, _WARN_PERIOD, _BAD_PERIOD)
    return Check(
        "rate",
        severity,
        f"{1 / period:.1f} poses a second; {uneven:.1%} of the steps are uneven, "
        f"the longest is {1000 * steps.max():.0f} ms",
        fix="" if severity == "ok" else "Set the app to 30 or 60 poses a second; cool the phone.",
    )
