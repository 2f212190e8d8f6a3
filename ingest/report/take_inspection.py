"""The inspection of a take: all checks of a session, a mount and a mesh, and the curves beside them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from pydantic import BaseModel, ValidationError

from ingest.film import check_decodes
from ingest.mount import Mount
from ingest.report import clamp_checks, sight, stance, track_checks
from ingest.report.checked_session import CheckedSession
from ingest.report.clamp_checks import gravity, gravity_angles
from ingest.report.phone_place import above_floor_check
from ingest.report.sight import agreement_checks
from ingest.report.stance import bottom
from ingest.report.take_report import Check, TakeReport, graded
from ingest.session import CaptureSession
from ingest.session_images import damaged_images, film_and_pairs, image_times, left_out
from ingest.trajectory.object_motion import ObjectTake
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS, ObjectMesh

_TINY, _SMALL, _LARGE, _HUGE = 0.06, 0.1, 2.5, 3.5
"""Metres, of the largest side: a phone is 0.15 long; a ladder 3; more is not carried about."""
_MANY_TRIANGLES = 200_000


def mesh_checks(mesh: ObjectMesh) -> list[Check]:
    """The mesh's size, its number of triangles, and what was done to read it."""
    sides = np.ptp(mesh.vertices, axis=0)
    largest = float(sides.max())
    message = " x ".join(f"{side:.2f}" for side in sides) + f" m, {len(mesh.faces):,} triangles"
    message = "; ".join([message, *mesh.notes])
    severity = (
        "bad" if not _TINY <= largest <= _HUGE else "ok" if _SMALL < largest < _LARGE else "warn"
    )
    fix = "Give the mesh in metres, or the factor to metres with ‹mesh_scale›."
    if severity == "ok" and len(mesh.faces) > _MANY_TRIANGLES:
        severity, fix = "warn", "Simplify the mesh: 20,000 triangles are plenty for a motion."
    return [graded("mesh", severity, message, fix)]


REPORT_PAGE, REPORT_DATA = "report.html", "report.json"
_MOST_BYTES = 1_000_000


class _ScanCheck(BaseModel):
    name: str
    severity: str


class _ScanVerdict(BaseModel):
    mesh: str
    usable: bool
    checks: tuple[_ScanCheck, ...]


def work_folder(mesh: Path) -> Path:
    """Return the folder beside a mesh that `omocap scan` keeps: report, pictures, model, stages."""
    return mesh.with_suffix(".scan")


def scan_checks(mesh: Path) -> tuple[Check, ...]:
    """Return one red check where `omocap scan` called this mesh not usable, else none.

    A mesh without a report of its own beside it, as those of other apps, is not judged.
    """
    report = work_folder(mesh) / REPORT_DATA
    try:
        if report.stat().st_size > _MOST_BYTES:
            return ()
        verdict = _ScanVerdict.model_validate_json(report.read_bytes())
    except (OSError, ValidationError):
        return ()
    if verdict.usable or verdict.mesh != mesh.name:
        return ()
    reasons = ", ".join(check.name for check in verdict.checks if check.severity == "bad")
    return (
        Check(
            "scan",
            "bad",
            f"omocap scan found its mesh {mesh.name} not usable: {reasons}",
            fix=f"Film the object again as {report.with_name(REPORT_PAGE)} says, or give another mesh.",
        ),
    )


def inspect_session(
    session: CaptureSession,
    *,
    mesh: ObjectMesh | None = None,
    mesh_file: Path | None = None,
    mount: Mount | None = None,
    take: ObjectTake | None = None,
    images: bool = False,
) -> TakeReport:
    """CheckedSession a take over, once `inspect_clock` finds that its stamps and units make sense.

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
    look = CheckedSession(session, mesh, mount, take)
    scanned = () if mesh_file is None else scan_checks(mesh_file)
    seen = [sight.sight(look)] if images else []
    return TakeReport((*first.checks, *_checks(look), *scanned, *seen))


def inspect_clock(session: CaptureSession) -> TakeReport:
    """The checks that need only stamps and positions.

    It is not complete when units are wrong: nothing else is worth telling then.
    """
    first = track_checks.units(session)
    others = (
        track_checks.duration(session),
        track_checks.rate(session),
        track_checks.steadiness(session),
    )
    return TakeReport((first, *others), first.severity != "bad")


def _assumptions(look: CheckedSession) -> Iterator[Check]:
    """What was left out or assumed when the log was read; no check if there is nothing to say."""
    log_notes = look.session.notes if look.take is None else look.take.assumptions
    if log_notes:
        yield Check("log", "ok", " ".join(log_notes))


def _checks(look: CheckedSession) -> Iterator[Check]:
    session = look.session
    yield from _assumptions(look)
    yield track_checks.share(look)
    yield from track_checks.faults(look)
    yield track_checks.repeats(session)
    yield track_checks.path_length(look)
    yield from track_checks.paces(look)
    yield gravity(look)
    yield from agreement_checks(look)
    yield stance.rests(look)
    yield stance.floor(look)
    yield from stance.lifted(look)
    yield from stance.falls(look)
    yield stance.closure(look)
    if look.mesh is not None:
        yield from mesh_checks(look.mesh)
    if look.mesh is not None and look.mount is not None:
        yield from clamp_checks.mount_checks(look.mesh, look.mount)
        if look.take is not None:
            yield above_floor_check(look.take, look.mount)
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
        fix = (
            "The log's camera columns contradict each other: compare them with the app's own file."
        )
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
    """Whether the video can be decoded, and which of its frames are which images of the log.

    Of an app that saves single images, whether these can be read.
    """
    if session.images:
        return _images(session.images, session.source)
    if session.video is None:
        return Check("video", "ok", "none: no overlay")
    try:
        film, pairs = film_and_pairs(session, session.video)
        check_decodes(film)
    except InputError as error:
        fix = f"{error.fix} The motion does not need it."
        return Check("video", "warn", error.what.rstrip("."), fix=fix)
    name, count = session.video.name, len(film.stamps)
    if pairs.lost <= 1 and not pairs.spare:
        return Check("video", "ok", f"{name}, {count} frames")
    # An overlay, a scan or a calibration pairs them the same way.
    return Check(
        "video",
        "warn",
        f"{name} has {count} frames, the log {len(image_times(session))} images; {len(pairs.images)} are "
        "paired by the film's stamps",
        fix="The others are left out; copy the session from the phone again if the film was whole.",
    )


def _images(files: Sequence[Path], source: Path) -> Check:
    try:
        lacking = left_out(damaged_images(files), len(files), source)
    except InputError as error:
        fix = f"{error.fix} The motion does not need them."
        return Check("video", "warn", error.what.rstrip("."), fix=fix)
    if not lacking:
        return Check("video", "ok", f"{len(files)} single images")
    return Check("video", "warn", lacking.rstrip("."), fix="The motion does not need them.")


Spans = list[tuple[float, float]]
"""Stretches in seconds from the start of the take."""


@dataclass(frozen=True)
class Curve:
    """A value over time; NaN breaks the line."""

    seconds: Float64[np.ndarray, " samples"]
    """From the start of the take."""
    values: Float64[np.ndarray, " samples"]


@dataclass(frozen=True)
class TakeSeries:
    """Curves over time, a path from above, and the stretches to shade under them."""

    seconds: float
    speed: Curve
    """Speed of the phone, m/s."""
    phone_height: Curve
    """Metres above the floor, or above the place where the session started."""
    object_height: Curve | None
    """Height of the object's lowest point above the floor, metres."""
    path: Float64[np.ndarray, "frames 2"]
    """Path of the object (or the phone) from above, metres; NaN breaks the line."""
    gravity: Curve | None
    """Degrees between the accelerometer's mean and the poses' down."""
    steps: Curve
    """Milliseconds from each pose to the next."""
    rests: Spans
    faults: Spans


def take_series(look: CheckedSession) -> TakeSeries:
    """What to plot of a take that is looked over."""
    session = look.session
    clock = session.times - session.times[0]
    T, valid = look.poses
    phone = np.where(valid[:, None], T[:, :3, 3], np.nan)
    grid = np.arange(len(T)) / FPS
    take = look.object_take
    place = T if take is None else take.motion.T_world_object
    bottoms = None if take is None else np.where(valid, bottom(take), np.nan)
    speed = np.where(valid, np.linalg.norm(velocity(phone, FPS), axis=1), np.nan)
    return TakeSeries(
        seconds=float(clock[-1]),
        speed=Curve(grid, speed),
        phone_height=Curve(grid, phone[:, 2]),
        object_height=None if bottoms is None else Curve(grid, bottoms),
        path=np.where(valid[:, None], place[:, :2, 3], np.nan),
        gravity=None if session.imu is None else Curve(*gravity_angles(session, look.up)),
        steps=Curve(clock[1:], 1000 * np.diff(clock)),
        rests=[(a / FPS, b / FPS) for a, b in look.rests],
        faults=[(float(clock[a]), float(clock[b])) for a, b in runs(look.breaks.any)],
    )
