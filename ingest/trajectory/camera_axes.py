"""Decide between ARKit's and OpenCV's camera axes for a log that does not state them."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from ingest.axes import T_OPENCV_ARKIT_CAMERA
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.breaks import find_breaks
from ingest.trajectory.config import STANDING
from ingest.trajectory.reading import Top
from ingest.trajectory.resample import resample
from ingest.trajectory.resting_up import axis_of, standing_ups
from ingest.trajectory.rests import find_rests
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_AGREES = np.cos(np.radians(STANDING.lean))
"""Cosine between up and the direction in which the object stands."""

Up = tuple[float, float, float] | Top


def settle_camera(
    session: CaptureSession, mesh: ObjectMesh, mount: Mount, up: Up | None
) -> CaptureSession:
    """Return the session with those camera axes with which the object stands on a stable side at rest.

    Args:
        session: returned unchanged if its camera axes are known.
        mesh: the object.
        mount: where it is in the phone's frame.
        up: in the session's world, or the axis of the mesh that is up at rest, if it is given.

    Raises:
        InputError: "axes-unknown" when it stands with both, or with none.
    """
    if not session.camera_open:
        return session
    turned = replace(session, T_world_phone=session.T_world_phone @ T_OPENCV_ARKIT_CAMERA)
    standing = [each for each in (session, turned) if _stands(each, mesh, mount, up)]
    if len(standing) != 1:
        how = "with both" if standing else "with neither (or never stands still)"
        raise InputError(
            "axes-unknown",
            f"The log does not say whether its camera has ARKit's axes (x right, y up, z towards the viewer) "
            f"or OpenCV's (y down, z forward), and the object stands where it rests {how}.",
            where=str(session.source),
            fix="Write the line `# axes: arkit` or `# axes: opencv` at the top of the log.",
        )
    usual = "those usual" if standing[0] is session else "other than usual"
    note = (
        f"The log does not say which axes its camera has. They are taken to be {usual} in {session.app}, for "
        "so the object stands where it rests."
    )
    return replace(standing[0], camera_open=False, notes=(*session.notes, note))


def _stands(session: CaptureSession, mesh: ObjectMesh, mount: Mount, up: Up | None) -> bool:
    """Whether the object rests on one of its sides, if the camera has the axes that it is read with."""
    T, valid = resample(session.times, session.T_world_phone, find_breaks(session).any)
    T_session_object = T @ mount.T_phone_object
    rests = find_rests(T_session_object, valid)
    if not rests:
        return False
    found = standing_ups(T_session_object, rests, mesh)
    if isinstance(up, str):
        start, stop = rests[0]
        top = T_session_object[start:stop, :3, :3].mean(axis=0) @ axis_of(up)
        found = [one for one in found if one @ top > _AGREES * np.linalg.norm(top)]
        up = None
    return any(_agree(one, session, up) for one in found)


def _agree(
    one: Float64[np.ndarray, "3"], session: CaptureSession, up: tuple[float, float, float] | None
) -> bool:
    """Whether a direction is up as it is given or logged, or along an axis that may be."""
    if up is not None:
        return bool(one @ np.asarray(up) > _AGREES * np.linalg.norm(up))
    axes = np.eye(3)[[1]] if session.gravity_aligned else np.eye(3)[[1, 2]]
    return bool((axes @ one).max() > _AGREES)
