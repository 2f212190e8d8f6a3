"""Which way is up in a session's world."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from ingest.session import CaptureSession
from ingest.trajectory.accelerometer import measured_up
from ingest.trajectory.axes import T_ZUP_ARKIT
from ingest.trajectory.depth_points import depth_points
from ingest.trajectory.plane import fit_plane
from ingest.trajectory.rests import find_rests
from omomo_core.errors import InputError
from omomo_core.geometry.shortest_turn import shortest_turn
from omomo_core.motion import FPS

NOTED, REFUSED = 5.0, 15.0
"""Degrees between the accelerometer and the log's up: told from the first, refused from the second."""
MAX_REST_SPREAD = 10.0
"""Degrees between the object's own up in any rest and in all of them."""
_MAX_FLOOR_TILT = np.radians(45)
"""Between the floor's normal and the object's own up over the take: it keeps walls out."""
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
    given: tuple[float, float, float] | None = None,
) -> Up:
    """Up in the session's world: as given, as the log has it, or as found.

    A log that is not gravity aligned is righted by the accelerometer, else by the object, whose
    own z axis points up where it rests, else by the floor that its depth maps show.

    Args:
        session: what the phone logged.
        T_session_object: the object at 30 fps.
        usable: which of these frames are tracked.
        given: up in the session's world, any length.

    Raises:
        InputError: "up-invalid", "gravity-wrong" when the accelerometer contradicts the poses,
            "gravity-ambiguous" when the object rests in several attitudes, "gravity-unknown".
    """
    if given is not None:
        return _as_given(given)
    measured = measured_up(session)
    if session.gravity_aligned:
        return _checked(session, measured)
    if len(measured):
        return _from_accelerometer(session, measured)
    found = _from_rests(session, T_session_object, usable)
    found = found or _from_depth(session, T_session_object, usable)
    if found is None:
        raise InputError(
            "gravity-unknown",
            f"{session.app} does not log which way is up, and nothing in the take tells: there is "
            "no accelerometer, the object never stands still, and no depth map shows the floor.",
            where=str(session.source),
            fix="Rest the object upright for a second at the start of the take, or give up in the "
            "session's world (--up).",
        )
    return found


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
            where="--up",
            fix="Give three numbers that are not all zero, e.g. 0,1,0 where y is up.",
        )
    return Up(vector / size, "given")


def _checked(session: CaptureSession, measured: Float64[np.ndarray, "windows 3"]) -> Up:
    off = float(np.median(_angles(measured, _Y))) if len(measured) else 0.0
    if off > REFUSED:
        raise _wrong(session, f"y, which {session.app} logs as up, is {off:.0f} deg from it")
    note = (
        "" if off <= NOTED else f"The accelerometer and the poses differ about up by {off:.0f} deg."
    )
    return Up(_Y, "log", note)


def _from_accelerometer(session: CaptureSession, measured: Float64[np.ndarray, "windows 3"]) -> Up:
    direction = np.median(measured, axis=0)
    direction = direction / (np.linalg.norm(direction) or 1.0)
    # Not the median: of a few windows, each one must agree.
    spread = float(_angles(measured, direction).mean())
    if spread > REFUSED:
        raise _wrong(session, f"it wanders by {spread:.0f} deg in the world of the poses")
    note = f"Up is found with the accelerometer (within {spread:.1f} deg)."
    return Up(direction, "accelerometer", note)


def _wrong(session: CaptureSession, what: str) -> InputError:
    return InputError(
        "gravity-wrong",
        f"The accelerometer's up contradicts the poses: {what}.",
        where=str(session.source),
        fix="Check that the files belong to one take of one app; if the poses are right, give up in "
        "the session's world (--up).",
    )


def _from_rests(
    session: CaptureSession,
    T: Float64[np.ndarray, "frames 4 4"],
    usable: Bool[np.ndarray, " frames"],
) -> Up | None:
    """The object's own z axis where it rests."""
    rests = find_rests(T, usable)
    if not rests:
        return None
    axes = np.stack([T[start:stop, :3, 2].mean(axis=0) for start, stop in rests])
    direction = np.average(axes, axis=0, weights=[stop - start for start, stop in rests])
    direction = direction / (np.linalg.norm(direction) or 1.0)
    when = ", ".join(f"{start / FPS:.1f} to {stop / FPS:.1f} s" for start, stop in rests)
    off = float(_angles(axes, direction).max())
    if off > MAX_REST_SPREAD:
        raise InputError(
            "gravity-ambiguous",
            f"{session.app} does not log which way is up, and the object rests in attitudes up to "
            f"{off:.0f} deg from their mean.",
            where=f"{session.source}, {when}",
            fix="Rest the object only upright, or give up in the session's world (--up).",
        )
    note = f"Up is taken from the object, which is taken to stand upright where it rests ({when})."
    return Up(direction, "rest", note)


def _from_depth(
    session: CaptureSession,
    T: Float64[np.ndarray, "frames 4 4"],
    usable: Bool[np.ndarray, " frames"],
) -> Up | None:
    """The normal of the largest plane that is roughly square to the object's mean z axis."""
    points = depth_points(session, usable)
    mean = T[usable, :3, 2].mean(axis=0)
    size = float(np.linalg.norm(mean))
    if points is None or size < 0.1:
        return None
    plane = fit_plane(points, mean / size, _MAX_FLOOR_TILT)
    if plane is None:
        return None
    return Up(plane.normal, "depth", "Up is taken from the floor that the depth maps show.")


def _angles(
    vectors: Float64[np.ndarray, "windows 3"], direction: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, " windows"]:
    cosine = vectors @ direction / np.linalg.norm(vectors, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))
