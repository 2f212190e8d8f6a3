"""Checks of the track: timing, tracking, pace."""

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import uniform_filter1d

from ingest.formats.camera_poses import PERIODS
from ingest.report.checked_session import USEFUL_SECONDS, CheckedSession
from ingest.report.take_report import Check, Severity, grade, graded, worst
from ingest.session import CaptureSession
from ingest.trajectory.segments import repeated_runs, velocities
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import apply
from omomo_core.motion import FPS

_LONG_SECONDS = 1800.0
_WARN_PERIOD, _BAD_PERIOD = 0.04, 0.09
"""Seconds between poses: under 25 Hz is coarse, at 10 Hz every step is a gap."""
_SHORTEST_PERIOD = 1 / 75
"""ARKit gives at most 60 poses a second."""
_DROP_WINDOW, _DROP = 61, 1.6
"""Steps over which the rate is taken, and the factor by which a hot phone slows (60 to 30)."""
_MILLISECOND = 1e-3
_LENGTH_UNITS = (("centimetres", 1e-2), ("millimetres", 1e-3))
_TOO_FAST, _FAST = 3.0, (0.1, 2.0)
"""m/s at the 90th percentile of a take: more than anybody moves, and the usual range."""


def duration(session: CaptureSession) -> Check:
    """Check of the length of the take."""
    seconds = float(session.times[-1] - session.times[0])
    message = f"{seconds:.1f} s, {len(session.times)} poses"
    if seconds > _LONG_SECONDS:
        return Check("duration", "warn", message, fix="Give one take, not a whole session.")
    severity = "ok" if seconds >= USEFUL_SECONDS else "warn"
    return graded("duration", severity, message, "Record at least three seconds.")


def rate(session: CaptureSession) -> Check:
    """Poses a second, and how evenly they come."""
    steps = np.diff(session.times)
    period = float(np.median(steps))
    uneven = float(np.mean(np.abs(steps - period) > 0.2 * period))
    message = (
        f"{1 / period:.1f} poses a second; {uneven:.1%} of the steps are uneven, "
        f"the longest is {1000 * steps.max():.0f} ms"
    )
    if period < _SHORTEST_PERIOD:
        fix = "ARKit gives at most 60: give the log as the app wrote it, not resampled or sped up."
        return Check("rate", "warn", message, fix=fix)
    severity = grade(period, _WARN_PERIOD, _BAD_PERIOD)
    fix = "Set the app to 30 or 60 poses a second; cool the phone."
    return graded("rate", severity, message, fix)


def steadiness(session: CaptureSession) -> Check:
    """Whether the rate stays: a hot phone falls from 60 to 30 poses a second, or fewer."""
    steps = np.diff(session.times)
    width = min(_DROP_WINDOW, len(steps))
    windows = np.lib.stride_tricks.sliding_window_view(steps, width)
    periods = np.median(windows, axis=1)
    slow = np.flatnonzero(periods > _DROP * np.median(periods[: max(1, len(periods) // 10)]))
    if not len(slow):
        return Check("steady rate", "ok", "the rate stays the same")
    first = int(slow[0]) + width // 2
    before, after = 1 / periods[0], 1 / float(np.median(periods[slow]))
    when = session.times[first] - session.times[0]
    return Check(
        "steady rate",
        "warn",
        f"from {before:.0f} to {after:.0f} poses a second at {when:.1f} s",
        (first, min(int(slow[-1]) + width, len(steps)) + 1),
        "The phone ran hot: let it cool, and record without the depth map or the screen's light.",
    )


def units(session: CaptureSession) -> Check:
    """Names another unit when stamps or positions make sense in it, and none in the right one."""
    steps = np.diff(session.times)
    period = float(np.median(steps))
    # Finer units make hours of a take, which the readers refuse.
    if period > 1 and PERIODS[0] < period * _MILLISECOND < PERIODS[1]:
        message = f"stamps {period:.3g} s apart look like milliseconds"
        return _wrong(message, "Give the stamps in seconds", _MILLISECOND)
    if (steps == 1).all():
        fix = "Give the time of each pose in seconds, not its number."
        return Check("units", "bad", "the stamps count the poses: 1, 2, 3", fix=fix)
    moved = np.linalg.norm(np.diff(session.T_world_phone[:, :3, 3], axis=0), axis=1)
    fast = float(np.percentile(moved / steps, 90))
    for name, unit in _LENGTH_UNITS:
        if fast > _TOO_FAST and _FAST[0] < fast * unit < _FAST[1]:
            return _wrong(
                f"a phone at {fast:.3g} m/s looks like {name}", "Give the positions in metres", unit
            )
    return Check("units", "ok", "seconds and metres")


def _wrong(message: str, do: str, unit: float) -> Check:
    return Check("units", "bad", message, fix=f"{do}: multiply them by {unit:g}.")


_FIX_TRACKING = "Keep the camera's view free, lit and textured; the take is split here."
_FIX_HOPELESS = (
    "Record again in a lit, textured room, below 2 m/s, with the camera's view free: no three "
    "seconds are left between the faults."
)
_MAX_SHOWN = 8
"""Faults of one kind that are listed one by one."""


def share(look: CheckedSession) -> Check:
    """How much of the take is tracked, and how much of that a run can use at most."""
    valid = look.poses[1]
    usable = sum(stop - start for start, stop in look.segments)
    tracked = float(valid.mean())
    message = f"{tracked:.0%} of the take, {usable / FPS:.1f} s of it in usable stretches"
    severity = grade(1 - usable / len(valid), 0.05, 0.7)
    return graded("tracked", severity, message, "Record again if the part you need is missing.")


def faults(look: CheckedSession) -> list[Check]:
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


_UNMOVED = 0.05
"""Metres within which what moves is no take: the tracker's drift, or a push."""
_MEAN_STEPS = 5
"""Steps over which a velocity is taken, so that a tracker's noise is not told as speed."""
_STRETCH = 0.1
"""Seconds over which an acceleration is taken: what shakes faster is noise of the tracker."""
_MAX_JUMP_STEPS = 3
"""A tracker corrects itself within a step or two; what is too fast for longer is motion."""
_SLOWER = "Move more slowly: fast motion blurs the image and the tracker loses the room."


def path_length(look: CheckedSession) -> Check:
    """Length of the phone's path; red where the object, if it is known, stays where it is."""
    steps = np.diff(look.session.T_world_phone[:, :3, 3], axis=0)
    length = float(np.linalg.norm(steps, axis=1).sum())
    reach = _reach(look)
    if reach > _UNMOVED:
        return Check("path", "ok", f"{length:.1f} m")
    thing = "phone" if look.object_take is None else "object"
    message = f"the {thing} moves by {100 * reach:.1f} cm in the whole take"
    fix = "Move the object with the phone clamped to it; if you did, the log is not in metres."
    return Check("path", "warn" if look.object_take is None else "bad", message, fix=fix)


def _reach(look: CheckedSession) -> float:
    """How far any point gets from where it was first, in the mean over half a second; metres."""
    poses, valid = look.poses
    points = np.zeros((1, 3))
    if look.object_take is not None:
        poses = look.object_take.motion.T_world_object
        points = sample_surface(look.object_take.motion.mesh).outline
    mean = uniform_filter1d(
        poses[valid], min(int(FPS / 2), int(valid.sum())), axis=0, mode="nearest"
    )
    first, *_ = apply(mean[:1], points)
    return max(
        float(np.linalg.norm(points @ pose[:3, :3].T + pose[:3, 3] - first, axis=1).max())
        for pose in mean[:: int(FPS / 6)]
    )


def paces(look: CheckedSession) -> list[Check]:
    """Median and 99th percentile of speed, acceleration and rotation speed."""
    session = look.session
    moving = _moving(look)
    linear, angular = (
        uniform_filter1d(np.where(moving[:, None], each, 0.0), _MEAN_STEPS, axis=0)
        for each in velocities(session.T_world_phone, np.diff(session.times)[:, None])
    )
    speed, turn = np.linalg.norm(linear, axis=1), np.degrees(np.linalg.norm(angular, axis=1))
    size, inside = accelerations(look, moving)
    pushed = Check("acceleration", "ok", "no stretch is long enough to tell")
    if inside.any():
        pushed = _pace(look, "acceleration", size, inside, "m/s²", (12.0, 30.0))
    return [
        _pace(look, "speed", speed, moving, "m/s", (3.0, 4.0)),
        pushed,
        _pace(look, "rotation speed", turn, moving, "deg/s", (330.0, 540.0)),
    ]


def _moving(look: CheckedSession) -> Bool[np.ndarray, " steps"]:
    """Steps that the phone made: no faults but fast motion, which is marked as jump after jump."""
    breaks = look.breaks
    moving = ~breaks.any
    for first, last in runs(breaks.jumps):
        moving[first:last] |= last - first > _MAX_JUMP_STEPS
    return moving if moving.any() else ~moving


def _pace(
    look: CheckedSession,
    name: str,
    values: Float64[np.ndarray, " steps"],
    used: Bool[np.ndarray, " steps"],
    unit: str,
    limits: tuple[float, float],
) -> Check:
    """Red where a run would use it, amber where the longest stretch is free of it."""
    median, high = np.percentile(values[used], [50, 99])
    message = f"median {median:.3g} {unit}, 99 % under {high:.3g} {unit}"
    over = runs(used & (values > limits[0]))
    longest = max(over, key=lambda run: run[1] - run[0], default=(0, len(values)))
    severity = grade(float(high), *limits)
    kept = used & look.used
    if severity == "bad" and look.has_usable and kept.any():
        severity = worst(["warn", grade(float(np.percentile(values[kept], 99)), *limits)])
    return graded(name, severity, message, _SLOWER, (longest[0], longest[1] + 1))


def accelerations(
    look: CheckedSession, used: Bool[np.ndarray, " steps"]
) -> tuple[Float64[np.ndarray, " steps"], Bool[np.ndarray, " steps"]]:
    """Size of the acceleration (m/s^2) over a tenth of a second about each step, and where it counts.

    Mean velocity of the half of it after minus that before, so that noise averages out.
    """
    times, place = look.session.times, look.session.T_world_phone[:, :3, 3]
    middle = (times[1:] + times[:-1]) / 2
    half = _STRETCH / 2

    def at(moment: Float64[np.ndarray, " steps"]) -> Float64[np.ndarray, "steps 3"]:
        return np.stack([np.interp(moment, times, axis) for axis in place.T], axis=1)

    change = at(middle + half) - 2 * at(middle) + at(middle - half)
    broken = np.concatenate([[0], np.cumsum(~used)])
    first = np.searchsorted(times, middle - half, side="right") - 1
    last = np.searchsorted(times, middle + half)
    inside = (first >= 0) & (last < len(times))
    inside &= broken[np.minimum(last, len(used))] == broken[np.maximum(first, 0)]
    return np.linalg.norm(change, axis=1) / half**2, inside
