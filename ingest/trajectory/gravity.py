"""The vertical of a session: by accelerometer, depth, rests, or the camera's axes."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation, Slerp

from ingest.axes import T_OPENCV_ARKIT_CAMERA, T_ZUP_ARKIT
from ingest.mount import Mount
from ingest.session import R_CAMERA_DEVICE, CaptureSession
from ingest.trajectory.plane import depth_points, fit_plane
from ingest.trajectory.rests import axis_of, find_resting_up, find_rests, standing_ups
from ingest.trajectory.segments import find_breaks
from ingest.trajectory.smooth import resample
from ingest.trajectory.trajectory_config import STANDING, VERTICAL, Top
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import shortest_turn
from omomo_core.motion import FPS, ObjectMesh


def measured_up(session: CaptureSession) -> Float64[np.ndarray, "windows 3"]:
    """Unit vector against the mean acceleration of each whole two seconds, in the session's world.

    Averaging in the world removes the phone's own acceleration: its velocity stays bounded. None
    (zero rows) without an accelerometer, or when it ran for less than two seconds of the take.
    """
    imu = session.imu
    if imu is None:
        return np.empty((0, 3))
    inside = (imu.times >= session.times[0]) & (imu.times <= session.times[-1])
    times = imu.times[inside]
    if len(times) == 0:
        return np.empty((0, 3))
    R_world_phone = Slerp(session.times, Rotation.from_matrix(session.T_world_phone[:, :3, :3]))
    world = R_world_phone(times).apply(imu.accel[inside] @ R_CAMERA_DEVICE.T)
    window = ((times - times[0]) // VERTICAL.window).astype(int)
    # The last window is not whole; a sum points where the mean does.
    sums = np.stack([np.bincount(window, axis)[:-1] for axis in world.T], axis=1)
    size = np.linalg.norm(sums, axis=1, keepdims=True)
    return -sums[size[:, 0] > 0] / size[size[:, 0] > 0]


_Y = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Up:
    """The direction against gravity."""

    direction: Float64[np.ndarray, "3"]
    """Unit vector in the session's world."""
    source: Literal["given", "log", "accelerometer", "rest", "depth"]
    note: str = ""
    """What the user should know about it; empty when there is nothing to say."""


def find_up(
    session: CaptureSession,
    T_session_object: Float64[np.ndarray, "frames 4 4"],
    usable: Bool[np.ndarray, " frames"],
    mesh: ObjectMesh,
    given: tuple[float, float, float] | Top | None = None,
) -> Up:
    """Up in the session's world: as given, as the log has it, or as found.

    A log that is not gravity aligned is righted by the accelerometer, else by the ways in which the
    object can stand where it rests, as far as they leave one answer.

    Args:
        session: what the phone logged.
        T_session_object: the object at 30 fps.
        usable: which of these frames are tracked.
        mesh: the object.
        given: up in the session's world, any length, or the axis of the mesh that is up at rest.

    Raises:
        InputError: "up-invalid", "gravity-wrong" when the accelerometer contradicts the poses,
            "gravity-ambiguous" when the object may rest on several sides or on none, or in other
            attitudes than the given one, "gravity-unknown" when nothing tells.
    """
    if isinstance(given, str):
        return _by_top(session, T_session_object, usable, given)
    if given is not None:
        return _as_given(given)
    known = known_up(session)
    if known is not None:
        return known
    rests = find_rests(T_session_object, usable)
    if not rests:
        raise _unknown(session)
    points = depth_points(session, usable)
    direction, note = find_resting_up(session, T_session_object, rests, usable, mesh, points)
    return Up(direction, "rest", note)


def known_up(session: CaptureSession) -> Up | None:
    """Up as the log or the accelerometer has it, whatever the phone is clamped to; None without either.

    Raises:
        InputError: "gravity-wrong" when the accelerometer contradicts the poses.
    """
    measured = measured_up(session)
    if session.gravity_aligned:
        return _checked(session, measured)
    return _from_accelerometer(session, measured) if len(measured) else None


def upright(up: Up) -> Float64[np.ndarray, "4 4"]:
    """T_zup_session: turns the session's world z up by the shortest way from ARKit's y up."""
    T = T_ZUP_ARKIT.copy()
    T[:3, :3] = T[:3, :3] @ shortest_turn(up.direction, _Y)
    return T


def _as_given(given: tuple[float, float, float]) -> Up:
    vector = np.asarray(given, dtype=np.float64)
    size = np.linalg.norm(vector)
    if not np.isfinite(size) or size < 1e-6:
        raise InputError(
            "up-invalid",
            f"{', '.join(f'{x:g}' for x in vector.ravel())} is no direction.",
            field="up",
            fix="Give three numbers that are not all zero, e.g. 0,1,0 where y is up.",
        )
    return Up(vector / size, "given")


def _checked(session: CaptureSession, measured: Float64[np.ndarray, "windows 3"]) -> Up:
    off = float(np.median(_angles(measured, _Y))) if len(measured) else 0.0
    if off > VERTICAL.refused:
        raise _wrong(session, f"y, which {session.app} logs as up, is {off:.0f} deg from it")
    note = (
        ""
        if off <= VERTICAL.noted
        else f"The accelerometer and the poses differ about up by {off:.0f} deg."
    )
    return Up(_Y, "log", note)


def _from_accelerometer(session: CaptureSession, measured: Float64[np.ndarray, "windows 3"]) -> Up:
    direction = np.median(measured, axis=0)
    direction = direction / (np.linalg.norm(direction) or 1.0)
    # Not the median: of a few windows, each one must agree.
    spread = float(_angles(measured, direction).mean())
    if spread > VERTICAL.refused:
        raise _wrong(session, f"it wanders by {spread:.0f} deg in the world of the poses")
    note = f"Up is found with the accelerometer (within {spread:.1f} deg)."
    return Up(direction, "accelerometer", note)


def _wrong(session: CaptureSession, what: str) -> InputError:
    return InputError(
        "gravity-wrong",
        f"The accelerometer's up contradicts the poses: {what}.",
        where=str(session.source),
        fix="Check that the files belong to one take of one app; if the poses are right, give up in "
        "the session's world (‹up›).",
    )


def _by_top(
    session: CaptureSession,
    T: Float64[np.ndarray, "frames 4 4"],
    usable: Bool[np.ndarray, " frames"],
    top: Top,
) -> Up:
    """Return the direction of a mesh axis at rest; without a rest, that of the floor near it."""
    axis = axis_of(top)
    rests = find_rests(T, usable)
    if not rests:
        return _from_depth(session, T, usable, axis)
    axes = np.stack([T[start:stop, :3, :3].mean(axis=0) @ axis for start, stop in rests])
    direction = np.average(axes, axis=0, weights=[stop - start for start, stop in rests])
    direction = direction / (np.linalg.norm(direction) or 1.0)
    off = float(_angles(axes, direction).max())
    if off > VERTICAL.rest_spread:
        when = ", ".join(f"{start / FPS:.1f} to {stop / FPS:.1f} s" for start, stop in rests)
        raise InputError(
            "gravity-ambiguous",
            f"The object rests in attitudes up to {off:.0f} deg from their mean, so no axis of it is up "
            "in all of them.",
            where=f"{session.source}, {when}",
            fix="Give up in the session's world (‹up› x,y,z), or rest the object on one side only.",
        )
    return Up(direction, "given")


def _from_depth(
    session: CaptureSession,
    T: Float64[np.ndarray, "frames 4 4"],
    usable: Bool[np.ndarray, " frames"],
    axis: Float64[np.ndarray, "3"],
) -> Up:
    """The normal of the largest plane that is roughly square to an axis of the object."""
    points = depth_points(session, usable)
    mean = T[usable, :3, :3].mean(axis=0) @ axis
    size = float(np.linalg.norm(mean))
    plane = None
    if points is not None and size > VERTICAL.steady_axis:
        plane = fit_plane(points, mean / size, np.radians(VERTICAL.floor_tilt))
    if plane is None:
        raise _unknown(session)
    return Up(plane.normal, "depth", "Up is taken from the floor that the depth maps show.")


def _unknown(session: CaptureSession) -> InputError:
    return InputError(
        "gravity-unknown",
        f"{session.app} does not log which way is up, and nothing in the take tells: there is no "
        "accelerometer, and the object never stands still.",
        where=str(session.source),
        fix="Rest the object for two seconds at the start of the take, or give up in the session's "
        "world (‹up› x,y,z).",
    )


def _angles(
    vectors: Float64[np.ndarray, "windows 3"], direction: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, " windows"]:
    cosine = vectors @ direction / np.linalg.norm(vectors, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


_AGREES = np.cos(np.radians(STANDING.lean))
"""Cosine between up and the direction in which the object stands."""

UpHint = tuple[float, float, float] | Top


def settle_camera(
    session: CaptureSession, mesh: ObjectMesh, mount: Mount, up: UpHint | None
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


def _stands(session: CaptureSession, mesh: ObjectMesh, mount: Mount, up: UpHint | None) -> bool:
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
