"""What the user should know about a take's tracking, in sentences."""

import numpy as np
from jaxtyping import Float64

from ingest.trajectory.breaks import Breaks
from ingest.trajectory.closure import Closure
from ingest.trajectory.stitch import Stitch
from omomo_core.geometry.runs import runs

_TOLD = 5
"""Faults of one kind that are told one by one."""


def break_notes(times: Float64[np.ndarray, " frames"], breaks: Breaks) -> list[str]:
    """One sentence per fault, with its time in the take."""
    seconds = times - times[0]
    notes: list[str] = []
    for name, mask in breaks.named():
        found = runs(mask)
        for first, last in found[:_TOLD]:
            when = f"{seconds[first]:.2f} to {seconds[last]:.2f} s"
            notes.append(f"{name.capitalize()} at {when}: the take is split there.")
        if len(found) > _TOLD:
            notes.append(f"{name.capitalize()}: {len(found) - _TOLD} more.")
    notes += _bridged(seconds, breaks)
    if breaks.jumps.any():
        notes.append("After a jump the object's height and place may be off by the jump.")
    return notes


def _bridged(seconds: Float64[np.ndarray, " frames"], breaks: Breaks) -> list[str]:
    steps = np.flatnonzero(breaks.holes)
    if len(steps) == 0:
        return []
    longest = int(steps[np.argmax(np.diff(seconds)[steps])])
    return [
        f"{len(steps)} hole(s) of up to {np.diff(seconds)[longest]:.2f} s in the log are bridged, for the "
        f"motion is smooth there (the longest at {seconds[longest]:.2f} s)."
    ]


def stitch_notes(times: Float64[np.ndarray, " frames"], stitches: list[Stitch]) -> list[str]:
    """One sentence per jump that was taken out."""
    return [
        f"Tracking jump of {stitch.metres:.2f} m and {np.degrees(stitch.radians):.1f} deg at "
        f"{times[stitch.step] - times[0]:.2f} s: the take after it is moved so that it goes on."
        for stitch in stitches
    ]


def closure_note(closure: Closure) -> str:
    """Return a sentence that says which drift was taken out."""
    return (
        f"A drift of {100 * closure.translation:.1f} cm and {closure.rotation:.1f} deg over "
        f"{closure.path:.1f} m is spread over the take, so that it ends where it began."
    )
