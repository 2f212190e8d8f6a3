"""Where a log must not be bridged: gaps, jumps, frozen and untracked stretches."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.session import CaptureSession
from ingest.trajectory.config import BREAKS
from ingest.trajectory.frozen import find_frozen
from ingest.trajectory.jumps import find_jumps, velocity_changes
from omomo_core.errors import InputError
from omomo_core.motion import FPS


@dataclass(frozen=True)
class Breaks:
    """Marks on the steps of a log; step i goes from pose i to pose i+1."""

    gaps: Bool[np.ndarray, " steps"]
    jumps: Bool[np.ndarray, " steps"]
    frozen: Bool[np.ndarray, " steps"]
    untracked: Bool[np.ndarray, " steps"]
    holes: Bool[np.ndarray, " steps"]
    """Long steps that are bridged, for the motion is smooth there: no faults."""

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
    long = np.diff(times) > BREAKS.longest_gap
    frozen = find_frozen(times, T)
    ok = session.tracking_ok
    untracked = np.zeros(len(long), bool) if ok is None else ~(ok[1:] & ok[:-1])
    jumps = find_jumps(times, T)
    holes = long & ~jumps & ~frozen & ~untracked & _is_smooth(times, T)
    gaps = long & ~holes
    jumps &= ~gaps & ~frozen & ~untracked
    return Breaks(gaps=gaps, jumps=jumps, frozen=frozen, untracked=untracked, holes=holes)


def _is_smooth(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> Bool[np.ndarray, " steps"]:
    """Whether a straight way over each step is near the true one: short, or hardly bent.

    What changes its velocity by v within t seconds is v t / 8 off the straight way in the middle.
    """
    dt = np.diff(times)
    bent, turned = (change * dt / 8 for change in velocity_changes(times, T))
    return (
        (dt < BREAKS.longest_hole)
        & (bent < BREAKS.hole_bend)
        & (turned < np.radians(BREAKS.hole_turn))
    )


def same_world(
    times: Float64[np.ndarray, " frames"], breaks: Breaks, stretch: tuple[int, int], count: int
) -> Bool[np.ndarray, " grid"]:
    """Which frames at 30 fps have the world of a stretch: no jump or loss of tracking lies between.

    Args:
        times: of the logged poses, seconds.
        breaks: between them.
        stretch: (start, stop), frames at 30 fps.
        count: of all frames.
    """
    moved = breaks.jumps | breaks.frozen | breaks.untracked | (np.diff(times) > BREAKS.pause)
    world = np.concatenate([[0], np.cumsum(moved)])
    grid = times[0] + np.arange(count) / FPS
    of_frame = world[(np.searchsorted(times, grid + 1e-6, side="right") - 1).clip(0)]
    return of_frame == of_frame[(stretch[0] + stretch[1]) // 2]


def check_rate(session: CaptureSession) -> None:
    """Refuse a log of 10 poses a second or fewer: every step of it is a gap.

    Raises:
        InputError: "rate-too-low".
    """
    period = float(np.median(np.diff(session.times)))
    if period > BREAKS.longest_period:
        raise InputError(
            "rate-too-low",
            f"The log has {1 / period:.3g} poses a second; how the object moved in between is not "
            "known.",
            where=str(session.source),
            fix="Set the app to 30 or 60 poses a second and record again.",
        )
