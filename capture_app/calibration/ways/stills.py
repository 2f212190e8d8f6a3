"""When the clamped phone stood still: as it is said, or as the log shows it."""

from collections.abc import Sequence

from ingest.calibration.still import Still, clamped_stills, named_stills
from ingest.session import CaptureSession


def chosen_stills(
    session: CaptureSession,
    spans: Sequence[tuple[float, float]],
    clamped_at: float,
    carried: float,
) -> tuple[list[Still], str]:
    """The stills that are named, or those found after the clamping, and a note about them.

    Args:
        session: the log.
        spans: seconds from its start; none are looked for.
        clamped_at: seconds from its start after which the phone is clamped; 0 where nobody says.
        carried: metres that the phone was carried before it was clamped, at least.

    Raises:
        InputError: those of `ingest.calibration.still`.
    """
    if spans:
        return named_stills(session, spans), ""
    return clamped_stills(session, after=clamped_at, path=0.0 if clamped_at else carried)
