"""Checks of the phone's speed and acceleration against what a person with an object can do.

Hand-held phones were measured at 1.1 m/s (99th percentile) and 90 degrees a second, and 4 m/s^2.
"""

import numpy as np
from jaxtyping import Bool, Float64

from ingest.report.check import Check, grade, graded, worst
from ingest.report.look import Look
from ingest.trajectory.jumps import velocities
from omomo_core.geometry.runs import runs

_STRETCH = 0.1
"""Seconds over which an acceleration is taken: what shakes faster is noise of the tracker."""
_MAX_JUMP_STEPS = 3
"""A tracker corrects itself within a step or two; what is too fast for longer is motion."""
_SLOWER = "Move more slowly: fast motion blurs the image and the tracker loses the room."


def path_length(look: Look) -> Check:
    """Length of the phone's path."""
    steps = np.diff(look.session.T_world_phone[:, :3, 3], axis=0)
    length = float(np.linalg.norm(steps, axis=1).sum())
    severity = "ok" if length > 0.3 else "warn"
    fix = "Move the object with the phone clamped to it; if you did, the log is not in metres."
    return graded("path", severity, f"{length:.1f} m", fix)


def paces(look: Look) -> list[Check]:
    """Median and 99th percentile of speed, acceleration and rotation speed."""
    session = look.session
    linear, angular = velocities(session.T_world_phone, np.diff(session.times)[:, None])
    speed, turn = np.linalg.norm(linear, axis=1), np.degrees(np.linalg.norm(angular, axis=1))
    moving = _moving(look)
    size, inside = accelerations(look, moving)
    pushed = Check("acceleration", "ok", "no stretch is long enough to tell")
    if inside.any():
        pushed = _pace(look, "acceleration", size, inside, "m/s²", (12.0, 30.0))
    return [
        _pace(look, "speed", speed, moving, "m/s", (2.0, 3.0)),
        pushed,
        _pace(look, "rotation speed", turn, moving, "deg/s", (240.0, 480.0)),
    ]


def _moving(look: Look) -> Bool[np.ndarray, " steps"]:
    """Steps that the phone made: no faults but fast motion, which is marked as jump after jump."""
    breaks = look.breaks
    moving = ~breaks.any
    for first, last in runs(breaks.jumps):
        moving[first:last] |= last - first > _MAX_JUMP_STEPS
    return moving if moving.any() else ~moving


def _pace(
    look: Look,
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
    look: Look, used: Bool[np.ndarray, " steps"]
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
