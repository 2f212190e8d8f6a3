"""The phone's poses of a session as a stream for the solver."""

import numpy as np

from ingest.calibration.hand_eye.streams import PoseStream
from ingest.session import CaptureSession
from ingest.trajectory.breaks import find_breaks
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs

_LEAST_SECONDS = 5.0


def phone_stream(session: CaptureSession) -> PoseStream:
    """The longest stretch of a session in which tracking never broke.

    Raises:
        InputError: "calibration-tracking" when it is shorter than five seconds.
    """
    whole = np.concatenate([~find_breaks(session).any, [False]])
    stretches = [(a, b + 1) for a, b in runs(whole)]
    longest = max(
        stretches, key=lambda s: session.times[s[1] - 1] - session.times[s[0]], default=(0, 1)
    )
    a, b = longest
    seconds = float(session.times[b - 1] - session.times[a])
    if seconds < _LEAST_SECONDS:
        raise InputError(
            "calibration-tracking",
            f"ARKit tracked without a break for {seconds:.1f} s at most; the calibration needs "
            f"{_LEAST_SECONDS:g} s.",
            where=str(session.source),
            fix="Record again where there is light and much to see, and move more slowly.",
        )
    return PoseStream(session.times[a:b], session.T_world_phone[a:b])
