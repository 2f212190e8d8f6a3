"""Stretches of a session in which the phone stands still, and whether the clamp slipped between."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.calibration.combine import DISAGREE, difference
from ingest.distributions import chi2_quantile
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.segments import find_breaks
from ingest.trajectory.smooth import resample
from ingest.uncertainty import between
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

CARRIED = 1.0
"""Metres that a phone is carried to scan an object, at least."""
MIN_SECONDS = 1.0
MAX_SHAKE, MAX_TREMBLE = 0.0015, np.radians(0.2)
"""Metres and rad (rms in a second) of a phone on a clamp; the steadiest hand shakes more."""
_EDGE = 0.15
"""Seconds at both ends of a still that may belong to the motion around it."""
_FRESH = 5.0
"""Poses a second that err by themselves: the tracker smooths its own jitter."""
MAP_ERROR = np.diag([np.radians(0.3) ** 2] * 3 + [0.0055**2] * 3)
"""Covariance (rad, m) of a place in ARKit's map by others: it differs from COLMAP's by 1 cm."""
DRIFT = 0.005
"""Expected distance that the tracker walks off, as a part of the path."""
DRIFT_TURN = np.radians(0.05)
"""Standard deviation on each axis of its turn per metre of path, rad."""
_OFF_MARK, _OFF_MARK_OF_PATH, _TURNED = 0.1, 0.05, 15.0
"""Metres, part of the path, degrees: an object farther from its first rest is not on its mark."""
_SLIPPED = chi2_quantile(1 - DISAGREE, 6)


@dataclass(frozen=True)
class Still:
    """A stretch of a log in which the phone does not move."""

    start: float
    stop: float
    """Seconds from the start of the log."""
    T_world_phone: Float64[np.ndarray, "4 4"]
    """The mean pose, in the session's world."""
    jitter: Float64[np.ndarray, "6 6"]
    """Covariance of that mean by the scatter of its poses alone (`ingest.uncertainty`)."""

    def covariance(self, path: float) -> Float64[np.ndarray, "6 6"]:
        """Covariance of the phone's pose relative to what it saw before it walked `path` metres.

        The jitter, the error of ARKit's map, which all stills share, and drift.
        """
        drifted = DRIFT * path / np.sqrt(8 / np.pi)  # of a normal vector's expected length
        turned = DRIFT_TURN * path
        return self.jitter + MAP_ERROR + np.diag(np.repeat([turned**2, drifted**2], 3))

    def __str__(self) -> str:
        return f"{self.start:.1f} to {self.stop:.1f} s"


def find_stills(session: CaptureSession) -> list[Still]:
    """The stretches of a second or more in which the phone is too steady to be in a hand."""
    T, valid = resample(session.times, session.T_world_phone, find_breaks(session).any)
    width = round(MIN_SECONDS * FPS) + 1
    if len(T) < width:
        return []
    quiet = _quiet(T, width) & np.lib.stride_tricks.sliding_window_view(valid, width).all(axis=-1)
    frames = np.convolve(quiet, np.ones(width)) > 0
    return [_still(session, start / FPS, (stop - 1) / FPS) for start, stop in runs(frames)]


def named_stills(session: CaptureSession, spans: Sequence[tuple[float, float]]) -> list[Still]:
    """The stretches that a user names, each with its mean pose.

    Args:
        session: the log.
        spans: start and stop in seconds from its start.

    Raises:
        InputError: "still-span" for a span without poses or with a break in it, or "still-moves".
    """
    broken = find_breaks(session).any
    stills: list[Still] = []
    for start, stop in spans:
        first, last = np.searchsorted(session.times - session.times[0], [start, stop])
        if last - first < 3 or broken[first : last - 1].any():
            raise InputError(
                "still-span",
                f"From {start:g} to {stop:g} s the log has no unbroken tracking.",
                where=str(session.source),
                fix=f"Name seconds within its {np.ptp(session.times):.1f} s in which the clamped "
                "phone stands still.",
            )
        still = _still(session, start, stop)
        _check_steady(session, still, int(first), int(last))
        stills.append(still)
    return stills


def clamped_stills(
    session: CaptureSession, *, after: float = 0.0, path: float = 0.0
) -> tuple[list[Still], str]:
    """The first still of the clamped phone, and the last one if the object is on its mark again.

    Args:
        session: the log.
        after: seconds from its start before which the phone was not clamped yet.
        path: metres that the phone was carried before it was clamped, at least.

    Returns:
        One still or two, and what the user should know about the choice.

    Raises:
        InputError: "no-still".
    """
    stills = [s for s in find_stills(session) if s.start >= after]
    stills = [s for s in stills if walked(session, 0.0, s.start) >= path]
    if not stills:
        raise InputError(
            "no-still",
            f"The phone never stands still for {MIN_SECONDS:g} s"
            + (" after it was carried about." if path else "."),
            where=str(session.source),
            fix="After clamping, leave object and phone alone for two seconds before you move them; "
            "or name the seconds in which they stood still (‹stills› 12.5:14).",
        )
    first, last = stills[0], stills[-1]
    if last is first:
        return [first], ""
    if (fault := break_between(session, first.stop, last.start)) is not None:
        return [first], f"The rest at the end ({last}) is not used: {fault}."
    step = between(first.T_world_phone, last.T_world_phone)
    shift, turn = np.linalg.norm(step[3:]), np.degrees(np.linalg.norm(step[:3]))
    allowed = _OFF_MARK + _OFF_MARK_OF_PATH * walked(session, first.stop, last.start)
    if shift > allowed or turn > _TURNED:
        return [first], (
            f"The rest at the end ({last}) is not used: it is {shift:.2f} m and {turn:.0f} deg from "
            f"the first ({first})."
        )
    return [first, last], ""


def disagreeing(
    T: Float64[np.ndarray, "poses 4 4"], covariances: Float64[np.ndarray, "poses 6 6"]
) -> tuple[int, int] | None:
    """The two estimates of one transform that differ most, if they differ beyond chance."""
    pairs = list(combinations(range(len(T)), 2))
    apart: list[float] = []
    for i, j in pairs:
        step = between(T[i], T[j])
        apart.append(float(step @ np.linalg.solve(covariances[i] + covariances[j], step)))
    if not pairs or max(apart) < _SLIPPED:
        return None
    return pairs[int(np.argmax(apart))]


def walked(session: CaptureSession, start: float, stop: float) -> float:
    """Metres that the phone travelled between two times (s from the start of the log).

    Measured over tenths of a second, so that a phone at rest does not travel by its jitter.
    """
    times = session.times - session.times[0]
    grid = np.arange(start, stop, 0.1)
    at = np.stack([np.interp(grid, times, x) for x in session.T_world_phone[:, :3, 3].T], axis=1)
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    return float(steps[steps > 2 * MAX_SHAKE].sum())


def break_between(session: CaptureSession, start: float, stop: float) -> str | None:
    """What broke the tracking between two times, in words; None when nothing did."""
    steps = np.searchsorted(session.times - session.times[0], [start, stop])
    for name, mask in find_breaks(session).named():
        found = np.flatnonzero(mask[slice(*steps)])
        if len(found):
            at = session.times[steps[0] + found[0]] - session.times[0]
            return f"there is a {name} at {at:.1f} s"
    return None


def _quiet(T: Float64[np.ndarray, "frames 4 4"], width: int) -> np.ndarray:
    """Which windows of `width` frames scatter no more than a clamped phone does."""
    values = np.concatenate([T[:, :3, 3], T[:, :3, :3].reshape(-1, 9)], axis=1)
    values = values - values.mean(axis=0)
    variance = np.lib.stride_tricks.sliding_window_view(values, width, axis=0).var(axis=-1)
    # The squared chord |A - B|_F^2 of two rotations is twice the squared angle between them.
    turn = np.sqrt(variance[:, 3:].sum(axis=1) / 2)
    return (np.sqrt(variance[:, :3].sum(axis=1)) < MAX_SHAKE) & (turn < MAX_TREMBLE)


def _still(session: CaptureSession, start: float, stop: float) -> Still:
    edge = min(_EDGE, (stop - start) / 4)
    first, last = np.searchsorted(
        session.times - session.times[0], [start + edge, stop - edge + 1e-6]
    )
    T = session.T_world_phone[first : max(last, first + 1)]
    mean = np.eye(4)
    mean[:3, :3] = Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix()
    mean[:3, 3] = T[:, :3, 3].mean(axis=0)
    steps = between(mean[None], T)
    fresh = max(1.0, _FRESH * (stop - start - 2 * edge))
    return Still(start, stop, mean, np.diag((steps**2).mean(axis=0)) / fresh)


def _check_steady(session: CaptureSession, still: Still, first: int, last: int) -> None:
    steps = between(still.T_world_phone[None], session.T_world_phone[first:last])
    turn, shift = np.sqrt((steps.reshape(-1, 2, 3) ** 2).sum(axis=-1).mean(axis=0))
    if shift > 2 * MAX_SHAKE or turn > 2 * MAX_TREMBLE:
        raise InputError(
            "still-moves",
            f"From {still} the phone moves by {1e3 * shift:.1f} mm and "
            f"{np.degrees(turn):.2f} deg (rms).",
            where=str(session.source),
            fix="Name only seconds in which object and phone were left alone.",
        )


@dataclass(frozen=True)
class Slip:
    """How far the object moved in the phone's frame."""

    mm: float
    """Shift of the object's origin, millimetres."""
    deg: float
    p: float
    """Chance that errors of the two calibrations alone look like that."""


def slip_between(first: Mount, second: Mount) -> Slip | None:
    """The slip between an earlier and a later result of one mount; None when they agree.

    What either leaves open cannot show a slip. In 1 of 1,000 mounts that held, errors look like one.

    Args:
        first: of the start of a take, with a covariance.
        second: of its end, with a covariance.

    Raises:
        InputError: "mount-without-covariance".
    """
    covariances = first.covariance, second.covariance
    if covariances[0] is None or covariances[1] is None:
        raise InputError(
            "mount-without-covariance",
            "A mount does not say how sure it is, so that a slip cannot be told from its error.",
            where=(first if first.covariance is None else second).method,
            fix="Calibrate it by a method that measures.",
        )
    apart = difference(first, second, (covariances[0], covariances[1]))
    return Slip(apart.mm, apart.deg, apart.p) if apart.disagrees else None


def refuse_slip(first: Mount, second: Mount) -> None:
    """Refuse two results of one take, of its start and its end, that a slip lies between.

    Raises:
        InputError: "mount-slipped", and those of `slip_between`.
    """
    slip = slip_between(first, second)
    if slip is None:
        return
    raise InputError(
        "mount-slipped",
        f"The mount slipped during the take: by {slip.mm:.0f} mm and {slip.deg:.1f} deg between its "
        f"start and its end (chance of that without a slip: {slip.p:.1g}).",
        fix="Fix the clamp and record again; or cut the take where it slipped, and use each "
        "calibration for its own part.",
    )
