"""inspect_session: every check on a take."""

from ingest.report import sensors, timing, tracking
from ingest.report.check import TakeReport
from ingest.session import CaptureSession


def inspect_session(session: CaptureSession) -> TakeReport:
    """Look a take over before spending time on it."""
    return TakeReport(
        (
            timing.duration(session),
            timing.rate(session),
            *tracking.faults(session),
            tracking.repeats(session),
            tracking.path_length(session),
            *tracking.speeds(session),
            sensors.gravity(session),
            sensors.intrinsics(session),
            sensors.video(session),
            tracking.floor_source(session),
        )
    )
