"""Faults of the tracker."""

import numpy as np

from ingest.report.check import Check, Severity, grade, graded
from ingest.report.look import Look
from ingest.session import CaptureSession
from ingest.trajectory.frozen import repeated_runs
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

_FIX_TRACKING = "Keep the camera's view free, lit and textured; the take is split here."
_FIX_HOPELESS = (
    "Record again in a lit, textured room, below 2 m/s, with the camera's view free: no three "
    "seconds are left between the faults."
)
_MAX_SHOWN = 8
"""Faults of one kind that are listed one by one."""


def share(look: Look) -> Check:
    """How much of the take is tracked, and how much of that a run can use at most."""
    valid = look.poses[1]
    usable = sum(stop - start for start, stop in look.segments)
    tracked = float(valid.mean())
    message = f"{tracked:.0%} of the take, {usable / FPS:.1f} s of it in usable stretches"
    severity = grade(1 - usable / len(valid), 0.05, 0.7)
    return graded("tracked", severity, message, "Record again if the part you need is missing.")


def faults(look: Look) -> list[Check]:
    """A check per gap, jump, frozen and untracked stretch, or one that says there is none.

    They split a take and spoil it only when no stretch of three seconds is left without them.
    """
    severity: Severity = "warn" if look.has_usable else "bad"
    checks: list[Check] = []
    for name, mask in look.breaks.named():
        found = runs(mask)
        if not found:
            checks.append(Check(name, "ok", "none"))
        shown = found if len(found) <= _MAX_SHOWN else found[: _MAX_SHOWN - 1]
        checks += [_fault(look.session, name, severity, *run) for run in shown]
        if len(shown) < len(found):
            checks.append(_rest_of_them(look.session, name, severity, found[len(shown) :]))
    return checks


def _fault(session: CaptureSession, name: str, severity: Severity, first: int, last: int) -> Check:
    seconds = session.times[[first, last]] - session.times[0]
    moved = np.linalg.norm(np.diff(session.T_world_phone[[first, last], :3, 3], axis=0))
    message = f"{seconds[0]:.2f} to {seconds[1]:.2f} s, {moved:.2f} m"
    return Check(name, severity, message, (first, last + 1), _fix(severity))


def _rest_of_them(
    session: CaptureSession, name: str, severity: Severity, found: list[tuple[int, int]]
) -> Check:
    frames = found[0][0], found[-1][1] + 1
    seconds = session.times[[frames[0], frames[1] - 1]] - session.times[0]
    message = f"{len(found)} more between {seconds[0]:.2f} and {seconds[1]:.2f} s"
    return Check(name, severity, message, frames, _fix(severity))


def _fix(severity: Severity) -> str:
    return _FIX_HOPELESS if severity == "bad" else _FIX_TRACKING


def repeats(session: CaptureSession) -> Check:
    """Bit-identical poses, which a live tracker does not write."""
    found = repeated_runs(session.times, session.T_world_phone)
    if not found:
        return Check("repeated poses", "ok", "none")
    first, last = max(found, key=lambda run: run[1] - run[0])
    seconds = session.times[last] - session.times[first]
    return Check(
        "repeated poses",
        "warn",
        f"{len(found)} runs of equal poses, the longest {seconds:.2f} s",
        (first, last + 1),
        "A live tracker never repeats a pose: check that the log is original.",
    )
