"""Where a log must not be bridged: gaps, jumps, frozen and untracked stretches."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ingest.session import CaptureSession
from ingest.trajectory.frozen import find_frozen
from ingest.trajectory.jumps import find_jumps

MAX_GAP = 0.1
"""Seconds between two poses that interpolation may span."""


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
