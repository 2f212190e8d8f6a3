"""What `omocap inspect` finds: the report on a session, and what a run would use of it."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh

from capture_app.manifest import TakeFinding
from ingest.formats.registry import read_session
from ingest.mesh import load_mesh
from ingest.mount import Mount, identity_mount
from ingest.mount_file import load_mount
from ingest.report.take_inspection import inspect_clock, inspect_session
from ingest.report.take_report import Check, TakeReport
from ingest.session import CaptureSession
from ingest.trajectory.object_motion import ObjectTake, to_object_motion
from ingest.trajectory.trajectory_config import AS_LOGGED, Reading
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_PHONE_SIZE = (0.147, 0.071, 0.008)
"""Metres; stands in for the object when none is given."""

Verdict = Literal["good", "usable with limits", "not usable"]


@dataclass(frozen=True)
class Inspection:
    """A session looked over; nothing is generated."""

    session: CaptureSession
    report: TakeReport
    take: ObjectTake | None
    """What a run would start from, None when the session is unusable."""
    problem: InputError | None
    """Why it is unusable."""
    mesh: ObjectMesh | None
    """The object, None when the phone alone was looked at."""
    mount: Mount

    @property
    def verdict(self) -> Verdict:
        """The verdict of all checks; `omocap run` refuses a take that is not usable."""
        if self.problem is not None or self.report.severity == "bad":
            return "not usable"
        return "good" if self.report.severity == "ok" else "usable with limits"

    @property
    def reason(self) -> str:
        """Why the verdict is not better, in one line; "" of a good take."""
        bad = self.report.of("bad")
        if self.problem is not None and not bad:
            return self.problem.what
        worst = bad or self.report.of("warn")
        return f"{worst[0].name}: {worst[0].message}" if worst else ""

    @property
    def advice(self) -> str:
        """The first thing to do about it, "" when there is nothing to do."""
        bad = self.report.of("bad")
        if self.problem is not None and not bad:
            return self.problem.fix
        return next((check.fix for check in bad or self.report.of("warn")), "")


def inspect_take(
    session: Path,
    mesh: Path | None = None,
    mount: Path | None = None,
    *,
    reading: Reading = AS_LOGGED,
    mesh_scale: float = 1.0,
    images: bool = False,
) -> Inspection:
    """Read and check a session.

    Args:
        session: the session's folder or file.
        mesh: the object; the phone alone if not given (the floor is then the phone's).
        mount: the mount's file; the identity if not given.
        reading: what its user says about the take.
        mesh_scale: factor that brings the mesh to metres.
        images: also test the poses' axes on a few images: a second or two.

    Raises:
        InputError: an input cannot be read at all.
    """
    fixed = load_mount(mount) if mount else identity_mount()
    moved = load_mesh(mesh, scale=mesh_scale * fixed.object_scale) if mesh else None
    read = read_session(session, reading.format)
    return look_over(read, moved, fixed, reading, mesh_file=mesh, images=images)


def look_over(
    session: CaptureSession,
    mesh: ObjectMesh | None,
    mount: Mount,
    reading: Reading = AS_LOGGED,
    *,
    mesh_file: Path | None = None,
    images: bool = False,
) -> Inspection:
    """Check a session that is read already.

    Args:
        session, mesh, mount, reading, images: as for `inspect_take`, but read.
        mesh_file: where the mesh was read from; the report of its scan is looked for beside it.
    """
    first = inspect_clock(session)
    if not first.complete:
        return Inspection(session, first, None, None, mesh, mount)
    take, problem = None, None
    if mesh is not None or _is_upright(session, reading):
        # How a phone by itself stands says nothing about the axes of its camera.
        read = session if mesh is not None else replace(session, camera_open=False)
        try:
            take = to_object_motion(read, mesh or _phone(), mount, reading)
        except InputError as error:
            problem = error
    report = inspect_session(
        session, mesh=mesh, mesh_file=mesh_file, mount=mount, take=take, images=images
    )
    return Inspection(session, report, take, problem, mesh, mount)


def refuse_bad(inspection: Inspection) -> None:
    """Refuse a take whose motion would be wrong.

    Raises:
        InputError: "take-bad", or the code of `to_object_motion`, with the red checks, their poses
            and what to do about each.
    """
    # Of many faults of one kind the first stands for all; the report lists them.
    first = {check.name: check for check in reversed(inspection.report.of("bad"))}
    bad = list(first.values())[::-1]
    if inspection.problem is not None:
        problems = " ".join([inspection.problem.what, *map(_problem_text, bad)])
        raise InputError(
            inspection.problem.code, problems, where=_where(inspection, bad), fix=inspection.advice
        )
    if bad:
        forced = ["To use the take all the same, add ‹force›."] if inspection.take else []
        raise InputError(
            "take-bad",
            " ".join(["The motion of this take would be wrong.", *map(_problem_text, bad)]),
            where=_where(inspection, bad),
            fix=" ".join([*dict.fromkeys(check.fix for check in bad), *forced]),
        )


def inspection_data(inspection: Inspection) -> dict[str, Any]:
    """Return an inspection as JSON, and whether a run would refuse the take."""
    take, refusal = inspection.take, None
    try:
        refuse_bad(inspection)
    except InputError as problem:
        refusal = problem
    return {
        "app": inspection.session.app,
        "source": str(inspection.session.source),
        "verdict": inspection.verdict,
        "reason": inspection.reason,
        "advice": inspection.advice,
        "usable": refusal is None,
        "problem": str(refusal) if refusal else None,
        "severity": inspection.report.severity,
        "checks": [asdict(check) for check in inspection.report.checks],
        "segments": [list(segment) for segment in take.segments] if take else [],
        "floor": {"height": take.floor.height, "source": take.floor.source} if take else None,
        "notes": list(take.notes) if take else [],
    }


def usable_take(inspection: Inspection, *, force: bool = False, strict: bool = False) -> ObjectTake:
    """Return what a run starts from; a bad take only by force, one that gives no motion at all never.

    Args:
        inspection: of the take.
        force: a bad take is used too.
        strict: a take of which something is to be looked at is not.

    Raises:
        InputError: "take-limited", or see `refuse_bad`.
    """
    if inspection.take is None or not force:
        refuse_bad(inspection)
    assert inspection.take is not None
    if strict and inspection.report.severity != "ok":
        raise _limited(inspection)
    return inspection.take


def findings(inspection: Inspection) -> tuple[TakeFinding, ...]:
    """Return what is to be looked at in a take, red before amber; one for each kind."""
    checks = [*inspection.report.of("bad"), *inspection.report.of("warn")]
    first = {check.name: check for check in reversed(checks)}
    return tuple(
        TakeFinding(name=check.name, message=check.message, fix=check.fix)
        for check in checks
        if first[check.name] is check
    )


def _limited(inspection: Inspection) -> InputError:
    seen = findings(inspection)
    return InputError(
        "take-limited",
        " ".join(["The take is usable with limits:", *map(_problem_text, seen)]),
        where=_where(inspection, inspection.report.of("warn")),
        fix=" ".join(
            [*dict.fromkeys(one.fix for one in seen), "To use it all the same, leave out ‹strict›."]
        ),
    )


def _problem_text(check: Check | TakeFinding) -> str:
    return f"{check.name.capitalize()}: {check.message.rstrip('.')}."


def _where(inspection: Inspection, bad: list[Check]) -> str:
    """The session, and the poses of each red check that concerns a part of it."""
    places = [
        f"{check.name} at poses {check.frames[0]} to {check.frames[1] - 1}"
        for check in bad
        if check.frames is not None
    ]
    return "; ".join([str(inspection.session.source), *places])


def _is_upright(session: CaptureSession, reading: Reading) -> bool:
    """Whether up is known without an object that rests."""
    return session.gravity_aligned or session.imu is not None or reading.up is not None


def _phone() -> ObjectMesh:
    box = trimesh.creation.box(_PHONE_SIZE)
    return ObjectMesh(np.asarray(box.vertices), np.asarray(box.faces), "phone")
