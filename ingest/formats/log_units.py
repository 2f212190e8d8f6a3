"""Units of logs: stamps and positions in seconds and metres, told by what is stated and by their size."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import FINER, Place
from omomo_core.errors import InputError

_RATES = 1 / 2000, 1 / 8
"""Seconds between two poses of any phone or tracker."""
_SLOWEST = 1.0
"""Seconds; poses that are farther apart follow no motion."""
_EVEN = 0.8
"""Part of the steps that are within half of the usual one, where stamps are those of a clock's ticks."""


@dataclass(frozen=True)
class Clock:
    """Stamps in seconds."""

    times: Float64[np.ndarray, " rows"]
    notes: tuple[str, ...] = ()
    """A sentence that says which unit was found, where none was stated."""


def read_clock(stamps: Float64[np.ndarray, " rows"], stated: float | None, place: Place) -> Clock:
    """Return stamps of a log in seconds.

    Without a stated unit they are seconds, unless they are more than a second apart, evenly, and in one
    of the finer units the poses come at an ordinary rate: then they are in that one.

    Args:
        stamps: as they are logged.
        stated: seconds in their unit, where the log says it.
        place: file and line of a row, for messages.

    Raises:
        InputError: "units-unclear" where the stated unit makes no sense of them and another one does.
    """
    step, even = _step(stamps)
    if stated is None:
        found = [name for name, unit in FINER.items() if _RATES[0] < step * unit < _RATES[1]]
        if not found or not even or step <= _SLOWEST:
            return Clock(stamps)
        note = f"Its stamps are {step:.6g} apart, so they are taken for {found[0]}."
        return Clock(stamps * FINER[found[0]], (note,))
    units = {"seconds": 1.0, **FINER}
    if not _RATES[0] / 10 <= step * stated <= 100 and even:
        fitting = [name for name, unit in units.items() if _RATES[0] < step * unit < _RATES[1]]
        named = next((name for name, unit in units.items() if unit == stated), f"{stated:g} s")
        if fitting:
            raise InputError(
                "units-unclear",
                f"Its stamps are said to be {named}, but they are {step:.6g} apart, as {fitting[0]} "
                "would be.",
                where=place(0),
                fix="Name the unit that the stamps are in.",
            )
    return Clock(stamps * stated)


def _step(stamps: Float64[np.ndarray, " rows"]) -> tuple[float, bool]:
    """The usual step from one stamp to the next, and whether most steps are about as long."""
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    if not len(steps):
        return 0.0, False
    usual = float(np.median(steps))
    return usual, float((np.abs(steps - usual) < 0.5 * usual).mean()) >= _EVEN


_REACH = 5.0
"""Metres between two things that are fixed to one object, at most."""
_LENGTHS = {"centimetres": 1e-2, "millimetres": 1e-3}


def refuse_lengths(
    speed: Float64[np.ndarray, " samples"],
    other: Float64[np.ndarray, " samples"],
    turning: Float64[np.ndarray, " samples"],
    where: str,
) -> None:
    """Refuse positions that are no metres, by another thing's on the same object that are.

    A point of a body moves by no more than another one of it does and what their distance sweeps.

    Args:
        speed: of what is judged, metres a second if its positions are metres, in rising order.
        other: of what is known, the same.
        turning: of both, radians a second, the same.
        where: the log that is judged.

    Raises:
        InputError: "units-length" naming the unit or units that fit.
    """
    fast, known, turns = (float(np.percentile(x, 90)) for x in (speed, other, turning))
    reach = (fast - known) / max(turns, 1e-3)
    if reach <= _REACH or fast <= known:
        return
    fitting = [name for name, unit in _LENGTHS.items() if fast * unit < known + _REACH * turns]
    if not fitting:
        return
    best = min(fitting, key=lambda name: abs(np.log(fast * _LENGTHS[name] / max(known, 1e-3))))
    raise InputError(
        "units-length",
        f"Its positions are no metres: it would move at {fast:.3g} m/s and be {reach:.3g} m away from the "
        f"phone on the same object. They look like {best}.",
        where=where,
        fix="Give positions in metres, or a header that names their unit, such as "
        "timestamp,x [mm],y [mm],z [mm],qx,qy,qz,qw.",
    )
