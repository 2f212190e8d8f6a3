"""From a session, a mesh and a mount to the object's motion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.closure import Closure, find_closure, spread
from ingest.trajectory.floor import Floor, find_floor
from ingest.trajectory.gravity import Up, find_up, settle_camera, upright
from ingest.trajectory.plane import depth_points
from ingest.trajectory.segments import (
    Breaks,
    Stitch,
    check_rate,
    choose,
    find_breaks,
    same_world,
    segments,
    stitch_jumps,
    within,
)
from ingest.trajectory.smooth import resample, smooth
from ingest.trajectory.trajectory_config import AS_LOGGED, Reading
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import apply
from omomo_core.motion import ObjectMesh, ObjectMotion

_MOST_LISTED = 5
"""Faults of one kind that get a sentence each."""


@dataclass(frozen=True)
class ObjectTake:
    """A take's object motion, and how its world hangs together with the session's."""

    motion: ObjectMotion
    """The whole take at 30 fps: frame k is at session.times[0] + k/30, not valid if broken."""
    segments: tuple[tuple[int, int], ...]
    """(start, stop) of the usable stretches, at least one."""
    chosen: int
    """Which of them is used, counted from 0; the floor is that under it."""
    T_world_arkit: Float64[np.ndarray, "4 4"]
    """Maps the session's world into ours: T_world_phone of ours = T_world_arkit @ theirs, but for
    noise, and for what stitching and closure moved."""
    floor: Floor
    up: Up
    closure: Closure | None
    """Between the object's rests at the start and at the end; None when it does not rest at both."""
    assumptions: tuple[str, ...]
    """What was left out or assumed when the log was read."""
    notes: tuple[str, ...]
    """What the user should know about this take, those among it."""


@dataclass(frozen=True)
class _Tracked:
    """The object in the session's world at 30 fps."""

    session: CaptureSession
    """With poses stitched and without noise."""
    T_session_object: Float64[np.ndarray, "frames 4 4"]
    valid: Bool[np.ndarray, " frames"]
    breaks: Breaks
    stitches: list[Stitch]


def to_object_motion(
    session: CaptureSession,
    mesh: ObjectMesh,
    mount: Mount,
    reading: Reading = AS_LOGGED,
) -> ObjectTake:
    """Turn phone poses into object poses: 30 fps, z up, floor at 0, first position at x = y = 0.

    Args:
        session: what the phone logged.
        mesh: the object, in its own frame, metres.
        mount: where the object is in the phone's frame.
        reading: what its user says about the take.

    Raises:
        InputError: "rate-too-low", "tracking-broken" when no stretch of a second is usable,
            "segment-missing", those of `ingest.trajectory.gravity.settle_camera`, of
            `ingest.trajectory.gravity.find_up`, and of `ingest.trajectory.closure.spread`.
    """
    session = settle_camera(session, mesh, mount, reading.up)
    tracked = _track(session, mount, reading.stitch)
    T_session_object, valid = tracked.T_session_object, tracked.valid
    stretches = segments(ObjectMotion(mesh, T_session_object, valid))
    if not stretches:
        raise _hopeless(session, tracked.breaks)
    chosen = choose(stretches, reading.segment, str(session.source))
    usable = within(stretches, len(valid))
    upward = find_up(tracked.session, T_session_object, usable, mesh, reading.up)
    T_zup_session = upright(upward)
    T_zup_object = T_zup_session @ T_session_object
    drift = find_closure(T_zup_object, usable)
    if reading.closure:
        T_zup_object = spread(T_zup_object, drift, str(session.source))
    here = usable & same_world(session.times, tracked.breaks, stretches[chosen], len(valid))
    points = None if reading.floor is not None else depth_points(tracked.session, here)
    if points is not None:
        points = apply(T_zup_session[None], points)[0]
    ground = find_floor(T_zup_object, here, mesh, reading.floor, points, usable & ~here)
    T_world_zup = np.eye(4)
    T_world_zup[:2, 3] = -T_zup_object[np.argmax(valid), :2, 3]
    T_world_zup[2, 3] = -ground.height
    return ObjectTake(
        motion=ObjectMotion(mesh, T_world_zup @ T_zup_object, valid),
        segments=tuple(stretches),
        chosen=chosen,
        T_world_arkit=T_world_zup @ T_zup_session,
        floor=ground,
        up=upward,
        closure=drift,
        assumptions=session.notes,
        notes=_notes(tracked, upward, drift if reading.closure else None, ground),
    )


def _track(session: CaptureSession, mount: Mount, stitch: bool) -> _Tracked:
    check_rate(session)
    breaks, stitches = find_breaks(session), list[Stitch]()
    if stitch:
        session, breaks, stitches = stitch_jumps(session, breaks)
    session = smooth(session, breaks.any)
    T_session_phone, valid = resample(session.times, session.T_world_phone, breaks.any)
    T_session_object = T_session_phone @ mount.T_phone_object
    return _Tracked(session, T_session_object, valid, breaks, stitches)


def _notes(tracked: _Tracked, up: Up, taken_out: Closure | None, floor: Floor) -> tuple[str, ...]:
    times = tracked.session.times
    notes = [*tracked.session.notes, *_break_notes(times, tracked.breaks)]
    notes += [*_stitch_notes(times, tracked.stitches), up.note]
    notes.append(_closure_note(taken_out) if taken_out else "")
    notes.append("" if floor.certain else floor.message)
    return tuple(note for note in notes if note)


def _hopeless(session: CaptureSession, breaks: Breaks) -> InputError:
    faults = ", ".join(
        f"{name} at {mask.sum()} steps" for name, mask in breaks.named() if mask.any()
    )
    return InputError(
        "tracking-broken",
        f"No second of the take is tracked without a fault ({faults}).",
        where=str(session.source),
        fix="Record again in a lit, textured room, at 30 or 60 poses a second, below 3 m/s.",
    )


def _break_notes(times: Float64[np.ndarray, " frames"], breaks: Breaks) -> list[str]:
    """One sentence per fault, with its time in the take."""
    seconds = times - times[0]
    notes: list[str] = []
    for name, mask in breaks.named():
        found = runs(mask)
        for first, last in found[:_MOST_LISTED]:
            when = f"{seconds[first]:.2f} to {seconds[last]:.2f} s"
            notes.append(f"{name.capitalize()} at {when}: the take is split there.")
        if len(found) > _MOST_LISTED:
            notes.append(f"{name.capitalize()}: {len(found) - _MOST_LISTED} more.")
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


def _stitch_notes(times: Float64[np.ndarray, " frames"], stitches: list[Stitch]) -> list[str]:
    """One sentence per jump that was taken out."""
    return [
        f"Tracking jump of {stitch.metres:.2f} m and {np.degrees(stitch.radians):.1f} deg at "
        f"{times[stitch.step] - times[0]:.2f} s: the take after it is moved so that it goes on."
        for stitch in stitches
    ]


def _closure_note(closure: Closure) -> str:
    """Return a sentence that says which drift was taken out."""
    return (
        f"A drift of {100 * closure.translation:.1f} cm and {closure.rotation:.1f} deg over "
        f"{closure.path:.1f} m is spread over the take, so that it ends where it began."
    )
