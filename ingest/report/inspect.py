"""inspect_session: all checks of a take."""

from collections.abc import Iterator
from pathlib import Path

import av
import av.error
import numpy as np

from ingest.mount import Mount
from ingest.report import clamp, pace, sight, solid, stance, timing, tracking
from ingest.report.agreement import agreement_checks
from ingest.report.check import Check, TakeReport
from ingest.report.gravity import gravity
from ingest.report.look import Look
from ingest.report.scanned import scan_checks
from ingest.session import CaptureSession
from ingest.trajectory.object_motion import ObjectTake
from omomo_core.motion import ObjectMesh


def inspect_session(
    session: CaptureSession,
    *,
    mesh: ObjectMesh | None = None,
    mesh_file: Path | None = None,
    mount: Mount | None = None,
    take: ObjectTake | None = None,
    images: bool = False,
) -> TakeReport:
    """Look a take over, once `inspect_clock` finds that its stamps and units make sense.

    Args:
        session: what the phone logged.
        mesh: the object, if it is known; its checks are left out otherwise.
        mesh_file: where that was read from; the report of its scan is looked for beside it.
        mount: where the object is in the phone's frame; None is the identity, and not checked.
        take: what `to_object_motion` makes of these, None when it refuses the session.
        images: also decode a few images and test the poses' axes on them: a second or two.
    """
    first = inspect_clock(session)
    if not first.complete:
        return first
    look = Look(session, mesh, mount, take)
    scanned = () if mesh_file is None else scan_checks(mesh_file)
    seen = [sight.sight(look)] if images else []
    return TakeReport((*first.checks, *_checks(look), *scanned, *seen))


def inspect_clock(session: CaptureSession) -> TakeReport:
    """The checks that need only stamps and positions.

    It is not complete when units are wrong: nothing else is worth telling then.
    """
    first = timing.units(session)
    others = timing.duration(session), timing.rate(session), timing.steadiness(session)
    return TakeReport((first, *others), first.severity != "bad")


def _assumptions(look: Look) -> Iterator[Check]:
    """What was left out or assumed when the log was read; no check if there is nothing to say."""
    log_notes = look.session.notes if look.take is None else look.take.assumptions
    if log_notes:
        yield Check("log", "ok", " ".join(log_notes))


def _checks(look: Look) -> Iterator[Check]:
    session = look.session
    yield from _assumptions(look)
    yield tracking.share(look)
    yield from tracking.faults(look)
    yield tracking.repeats(session)
    yield pace.path_length(look)
    yield from pace.paces(look)
    yield gravity(look)
    yield from agreement_checks(look)
    yield stance.rests(look)
    yield stance.floor(look)
    yield from stance.lifted(look)
    yield stance.closure(look)
    if look.mesh is not None:
        yield from solid.mesh_checks(look.mesh)
    if look.mesh is not None and look.mount is not None:
        yield from clamp.mount_checks(look.mesh, look.mount)
    yield from stance.object_checks(look)
    yield _intrinsics(session)
    yield _video(session)


def _intrinsics(session: CaptureSession) -> Check:
    """Whether the camera is known and plausible, for overlays and for calibrating the mount."""
    if session.intrinsics is None:
        return Check("intrinsics", "ok", "none: no overlay on the video")
    focal = session.intrinsics[:, 0]
    message = f"fx {focal.min():.0f} to {focal.max():.0f} px"
    if not (session.intrinsics > 0).all() or np.ptp(focal) >= 0.2 * focal.mean():
        fix = "The log's camera columns are damaged: copy the session again."
        return Check("intrinsics", "warn", message, fix=fix)
    if session.image_size is not None:
        off = session.intrinsics[:, 2:].mean(axis=0) / session.image_size - 0.5
        if np.abs(off).max() > 0.1:
            return Check(
                "intrinsics",
                "warn",
                f"{message}; the centre is {off[0]:+.0%}, {off[1]:+.0%} off the middle of "
                f"{session.image_size[0]} x {session.image_size[1]} px",
                fix="They belong to a turned or cropped image: log the landscape sensor image.",
            )
    return Check("intrinsics", "ok", message)


def _video(session: CaptureSession) -> Check:
    """Whether the video is there and has a frame per logged image (its header is read, no more)."""
    if session.video is None:
        return Check("video", "ok", "none: no overlay")
    try:
        with av.open(str(session.video)) as container:
            frames = container.streams.video[0].frames
    except (av.error.FFmpegError, IndexError) as problem:
        fix = "Copy the session from the phone again; the motion does not need it."
        return Check("video", "warn", f"{session.video.name} cannot be read: {problem}", fix=fix)
    wanted = len(session.times if session.video_times is None else session.video_times)
    # Stray Scanner stamps its first frame before zero, and some tools drop it.
    if frames in (0, wanted, wanted - 1):
        return Check("video", "ok", f"{session.video.name}, {frames or 'unknown number of'} frames")
    return Check(
        "video",
        "warn",
        f"{session.video.name} has {frames} frames, the log {wanted} images",
        fix="An overlay would run out of step; copy the session from the phone again.",
    )
