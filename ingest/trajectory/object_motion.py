"""The phone's log becomes the object's motion over our floor."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.axes import T_ZUP_ARKIT
from ingest.trajectory.breaks import Breaks, find_breaks
from ingest.trajectory.floor import Floor, find_floor
from ingest.trajectory.resample import resample
from ingest.trajectory.segments import segments
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.motion import ObjectMesh, ObjectMotion


@dataclass(frozen=True)
class ObjectTake:
    """A take's object motion, and how its world hangs together with the session's."""

    motion: ObjectMotion
    """The whole take at 30 fps: frame k is at session.times[0] + k/30, not valid if broken."""
    segments: tuple[tuple[int, int], ...]
    """(start, stop) of the usable stretches, at least one."""
    T_world_arkit: Float64[np.ndarray, "4 4"]
    """Maps the session's world (y up) into ours: T_world_phone of ours = T_world_arkit @ theirs."""
    floor: Floor
    notes: tuple[str, ...]
    """What the user should know about this take."""


def to_object_motion(
    session: CaptureSession, mesh: ObjectMesh, mount: Mount, *, floor: float | None = None
) -> ObjectTake:
    """Turn phone poses into object poses: 30 fps, z up, floor at 0, first position at x = y = 0.

    Args:
        session: what the phone logged.
        mesh: the object, in its own frame, metres.
        mount: where the object is in the phone's frame.
        floor: height of the floor in the session's ARKit world (its y axis, metres; negative when
            it is below the place where the session started); None finds it.

    Raises:
        InputError: "tracking-broken" when no stretch of a second is usable.
    """
    breaks = find_breaks(session)
    T_arkit_phone, valid = resample(session.times, session.T_world_phone, breaks.any)
    T_zup_object = T_ZUP_ARKIT @ T_arkit_phone @ mount.T_phone_object
    _refuse_hopeless(session, breaks, ObjectMotion(mesh, T_zup_object, valid))
    ground = find_floor(T_zup_object, valid, mesh, floor)
    T_world_zup = np.eye(4)
    T_world_zup[:2, 3] = -T_zup_object[np.argmax(valid), :2, 3]
    T_world_zup[2, 3] = -ground.height
    motion = ObjectMotion(mesh, T_world_zup @ T_zup_object, valid)
    notes = _break_notes(session, breaks)
    return ObjectTake(
        motion=motion,
        segments=tuple(segments(motion)),
        T_world_arkit=T_world_zup @ T_ZUP_ARKIT,
        floor=ground,
        notes=tuple(notes if ground.certain else [*notes, ground.message]),
    )


def _refuse_hopeless(session: CaptureSession, breaks: Breaks, motion: ObjectMotion) -> None:
    if segments(motion):
        return
    faults = ", ".join(
        f"{name} at {mask.sum()} steps" for name, mask in breaks.named() if mask.any()
    )
    raise InputError(
        "tracking-broken",
        f"No second of the take is tracked without a fault ({faults}).",
        where=str(session.source),
        fix="Record again in a lit, textured room, at 30 or 60 poses a second, below 3 m/s.",
    )


def _break_notes(session: CaptureSession, breaks: Breaks) -> list[str]:
    """One sentence per fault, with its time in the take."""
    seconds = session.times - session.times[0]
    notes: list[str] = []
    for name, mask in breaks.named():
        found = runs(mask)
        for first, last in found[:5]:
            when = f"{seconds[first]:.2f} to {seconds[last]:.2f} s"
            notes.append(f"{name.capitalize()} at {when}: the take is split there.")
        if len(found) > 5:
            notes.append(f"{name.capitalize()}: {len(found) - 5} more.")
    if breaks.jumps.any():
        notes.append("After a jump the object's height and place may be off by the jump.")
    return notes
