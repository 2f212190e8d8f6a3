"""Faults of the tracker, and how the phone moved."""

import numpy as np

from ingest.report.check import Check, grade
from ingest.session import CaptureSession
from ingest.trajectory.axes import T_ZUP_ARKIT
from ingest.trajectory.breaks import find_breaks
from ingest.trajectory.frozen import repeated_runs
from ingest.trajectory.jumps import velocities
from ingest.trajectory.resample import resample
from ingest.trajectory.rests import find_rests
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

_FIX_TRACKING = "Keep the camera's view free, lit and textured; the take is split here."


def faults(session: CaptureSession) -> list[Check]:
    """A check per gap, jump, frozen and untracked stretch, or one that says there is none."""
    checks: list[Check] = []
    seconds = session.times - session.times[0]
    for name, mask in find_breaks(session).named():
        found = runs(mask)
        if not found:
            checks.append(Check(name, "ok", "none"))
        for first, last in found:
            moved = np.linalg.norm(np.diff(session.T_world_phone[[first, last], :3, 3], axis=0))
            message = f"{seconds[first]:.2f} to {seconds[last]:.2f} s, {moved:.2f} m"
            checks.append(Check(name, "bad", message, (first, last + 1), _FIX_TRACKING))
    return checks


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


def path_length(session: CaptureSession) -> Check:
    """How far the phone went."""
    length = float(np.linalg.norm(np.diff(session.T_world_phone[:, :3, 3], axis=0), axis=1).sum())
    severity = "ok" if length > 0.3 else "warn"
    fix = "" if length > 0.3 else "Move the object with the phone clamped to it."
    return Check("path", severity, f"{length:.1f} m", fix=fix)


def speeds(session: CaptureSession) -> list[Check]:
    """Median and 99th percentile of speed and of rotation speed."""
    linear, angular = velocities(session.T_world_phone, np.diff(session.times)[:, None])
    speed = np.percentile(np.linalg.norm(linear, axis=1), [50, 99])
    turn = np.degrees(np.percentile(np.linalg.norm(angular, axis=1), [50, 99]))
    slower = "Move more slowly: fast motion blurs the image and the tracker loses the room."
    by_speed, by_turn = grade(speed[1], 2.0, 3.0), grade(turn[1], 240.0, 480.0)
    return [
        Check(
            "speed",
            by_speed,
            f"median {speed[0]:.2f} m/s, 99 % under {speed[1]:.2f} m/s",
            fix="" if by_speed == "ok" else slower,
        ),
        Check(
            "rotation speed",
            by_turn,
            f"median {turn[0]:.0f} deg/s, 99 % under {turn[1]:.0f} deg/s",
            fix="" if by_turn == "ok" else slower,
        ),
    ]


def floor_source(session: CaptureSession) -> Check:
    """Whether the floor can be found from where the object rests."""
    T, valid = resample(session.times, session.T_world_phone, find_breaks(session).any)
    rests = find_rests(T_ZUP_ARKIT @ T, valid)
    if not rests:
        return Check(
            "floor",
            "warn",
            "the object never stands still for half a second: the floor would be a guess",
            fix="Start and end the take with the object on the floor for a second, or give the "
            "floor's height (--floor).",
        )
    start, stop = min(rests, key=lambda rest: float(np.median(T[rest[0] : rest[1], 1, 3])))
    grid = session.times[0] + np.array([start, stop - 1]) / FPS
    first, last = np.searchsorted(session.times, grid - 1e-6)
    return Check(
        "floor",
        "ok",
        f"from where the object stands still, {start / FPS:.1f} to {stop / FPS:.1f} s",
        (int(first), int(last) + 1),
    )
