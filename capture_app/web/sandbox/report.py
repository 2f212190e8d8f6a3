"""A take report as the page shows it: words and seconds, no arrays."""

from typing import Any

import numpy as np
from jaxtyping import Float64

from capture_app.inspection import Inspection
from ingest.report.take_report import Check
from omomo_core.errors import OmocapError
from omomo_core.motion import FPS


def report_data(seen: Inspection) -> dict[str, Any]:
    """What was found, as JSON."""
    times = seen.session.times - seen.session.times[0]
    spans = [[a / FPS, b / FPS] for a, b in seen.take.segments] if seen.take else []
    seconds, poses = _finite(times[-1]), len(times)
    rate = _finite(1 / np.median(np.diff(times))) if poses > 1 else None
    longest = max((b - a for a, b in spans), default=None)
    return {
        "verdict": seen.verdict,
        "reason": seen.reason,
        "advice": seen.advice,
        "app": seen.session.app,
        "seconds": seconds,
        "poses": poses,
        "rate": rate,
        "checks": [_check(check, times) for check in seen.report.checks],
        "segments": spans,
        "floor": seen.take.floor.message if seen.take and seen.mesh else "",
        "problem": None if seen.problem is None else problem_data(seen.problem),
        "facts": {
            "seconds": seconds,
            "rate": rate,
            "stretches": len(spans) if seen.take else None,
            "longest": longest,
        },
    }


def unreadable(problem: OmocapError) -> dict[str, Any]:
    """The same of a session that cannot be read at all."""
    told = {"verdict": "not usable", "reason": problem.what, "advice": problem.fix}
    return {**_NOTHING, **told, "problem": problem_data(problem)}


def own_motion() -> dict[str, Any]:
    """The same of an object's own motion, which no phone tracked and nobody judges."""
    return {**_NOTHING, "verdict": "not judged", "animated": True}


_NOTHING: dict[str, Any] = {
    "verdict": "",
    "reason": "",
    "advice": "",
    "app": "",
    "animated": False,
    "seconds": 0.0,
    "poses": 0,
    "rate": None,
    "checks": [],
    "segments": [],
    "floor": "",
    "problem": None,
    "facts": {"seconds": None, "rate": None, "stretches": None, "longest": None},
}


def problem_data(problem: OmocapError) -> dict[str, str]:
    """An error as JSON."""
    return {
        "code": problem.code,
        "what": problem.what,
        "where": problem.where,
        "fix": problem.fix,
    }


def _check(check: Check, times: Float64[np.ndarray, " poses"]) -> dict[str, Any]:
    return {
        "name": check.name,
        "severity": check.severity,
        "message": check.message,
        "fix": check.fix,
        "frames": None if check.frames is None else list(check.frames),
        "seconds": None if check.frames is None else _seconds(check.frames, times),
    }


def _seconds(frames: tuple[int, int], times: Float64[np.ndarray, " poses"]) -> list[float | None]:
    """From the first pose of a stretch to its last."""
    last = len(times) - 1
    first, stop = (min(max(k, 0), last) for k in (frames[0], frames[1] - 1))
    return [_finite(times[first]), _finite(times[stop])]


def _finite(value: float) -> float | None:
    """JSON has no NaN."""
    return round(float(value), 4) if np.isfinite(value) else None
