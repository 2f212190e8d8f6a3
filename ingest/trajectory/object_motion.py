"""The phone's log becomes the object's motion over our floor."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.breaks import Breaks, check_rate, find_breaks, same_world
from ingest.trajectory.camera_axes import settle_camera
from ingest.trajectory.closure import Closure, find_closure, spread
from ingest.trajectory.depth_points import depth_points
from ingest.trajectory.floor import Floor, find_floor
from ingest.trajectory.gravity import Up, find_up, upright
from ingest.trajectory.notes import break_notes, closure_note, stitch_notes
from ingest.trajectory.reading import AS_LOGGED, Reading
from ingest.trajectory.resample import resample
from ingest.trajectory.segments import choose, segments, within
from ingest.trajectory.smooth import smooth
from ingest.trajectory.stitch import Stitch, stitch_jumps
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import apply
from omomo_core.motion import ObjectMesh, ObjectMotion


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
            "segment-missing", those of `ingest.trajectory.camera_axes.settle_camera`, of
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
    notes = [*tracked.session.notes, *break_notes(times, tracked.breaks)]
    notes += [*stitch_notes(times, tracked.stitches), up.note]
    notes.append(closure_note(taken_out) if taken_out else "")
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
