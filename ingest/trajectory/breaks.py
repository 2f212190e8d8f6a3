"""Where a log must not be bridged: gaps, jumps, frozen and untracked stretches."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ingest.session import CaptureSession
from ingest.trajectory.frozen import find_frozen
from ingest.trajectory.jumps import find_jumps
from omomo_core.errors import InputError

MAX_GAP = 0.1
"""Seconds between two poses that interpolation may span."""
_MAX_PERIOD = 0.095
"""Seconds between poses as a rule; closer to MAX_GAP, its jitter makes a gap of every other step."""


@dataclass(frozen=True)
class Breaks:
    """Marks on the steps of a log; step i goes from pose i to pose i+1."""

    gaps: Bool[np.ndarray, " steps"]
    jumps: Bool[np.ndarray, " steps"]
    frozen: Bool[np.ndarray, " steps"]
    untracked: Bool[np.ndarray, " steps"]

    @property
    def any(self) -> Bool[np.ndarray, " steps"]:
        """Steps with any of the faults."""
        return self.gaps | self.jumps | self.frozen | self.untracked

    def named(self) -> list[tuple[str, Bool[np.ndarray, " steps"]]]:
        """Each fault with the words for it."""
        return [
            ("gap in the log", self.gaps),
            ("tracking jump", self.jumps),
            ("frozen tracking", self.frozen),
            ("limited tracking", self.untracked),
        ]


def find_breaks(session: CaptureSession) -> Breaks:
    """All the steps of a session that its motion must be split at.

    A jump is one step; the step out of a gap or a freeze is not counted as a jump again.
    """
    times, T = session.times, session.T_world_phone
    gaps = np.diff(times) > MAX_GAP
    frozen = find_frozen(times, T)
    ok = session.tracking_ok
    untracked = np.zeros(len(gaps), bool) if ok is None else ~(ok[1:] & ok[:-1])
    jumps = find_jumps(times, T) & ~gaps & ~frozen & ~untracked
    return Breaks(gaps=gaps, jumps=jumps, frozen=frozen, untracked=untracked)


def check_rate(session: CaptureSession) -> None:
    """Refuse a log of 10 poses a second or fewer: every step of it is a gap.

    Raises:
        InputError: "rate-too-low".
    """
    period = float(np.median(np.diff(session.times)))
    if period > _MAX_PERIOD:
        raise InputError(
            "rate-too-low",
            f"The log has {1 / period:.3g} poses a second; how the object moved in between is not "
            "known.",
            where=str(session.source),
            fix="Set the app to 30 or 60 poses a second and record again.",
        )
