"""What `omocap inspect` finds: the report on a session, and what a run would use of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from ingest.formats.detect import read_session
from ingest.mesh import load_mesh
from ingest.mount import identity_mount, load_mount
from ingest.report.check import TakeReport
from ingest.report.inspect import inspect_session
from ingest.session import CaptureSession
from ingest.trajectory.object_motion import ObjectTake, to_object_motion
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_PHONE_SIZE = (0.147, 0.071, 0.008)
"""Metres; stands in for the object when none is given."""


@dataclass(frozen=True)
class Inspection:
    """A session looked over; nothing is generated."""

    session: CaptureSession
    report: TakeReport
    take: ObjectTake | None
    """What a run would start from, None when the session is unusable."""
    problem: InputError | None
    """Why it is unusable."""


def inspect_take(
    session: Path,
    mesh: Path | None = None,
    mount: Path | None = None,
    *,
    floor: float | None = None,
    mesh_scale: float = 1.0,
) -> Inspection:
    """Read and check a session.

    Args:
        session: the session's folder or file.
        mesh: the object; the phone alone if not given (the floor is then the phone's).
        mount: the mount's file; the identity if not given.
        floor: height of the floor in the session's world, metres.
        mesh_scale: factor that brings the mesh to metres.

    Raises:
        InputError: an input cannot be read at all.
    """
    moved = load_mesh(mesh, scale=mesh_scale) if mesh else _phone()
    fixed = load_mount(mount) if mount else identity_mount()
    read = read_session(session)
    report = inspect_session(read)
    try:
        take = to_object_motion(read, moved, fixed, floor=floor)
    except InputError as problem:
        return Inspection(read, report, None, problem)
    return Inspection(read, report, take, None)


def _phone() -> ObjectMesh:
    box = trimesh.creation.box(_PHONE_SIZE)
    return ObjectMesh(np.asarray(box.vertices), np.asarray(box.faces), "phone")
