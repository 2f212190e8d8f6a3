"""Find up in a world without measured gravity from the stable poses in which the object can rest."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64
from scipy.sparse.csgraph import connected_components

from ingest.session import CaptureSession
from ingest.trajectory.config import STANDING
from ingest.trajectory.plane import fit_plane
from ingest.trajectory.reading import Top
from ingest.trajectory.stable import standing_sides, tilt_from_standing
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import nearest_rotation, shortest_turn
from omomo_core.motion import FPS, ObjectMesh

_ONE_ANSWER = np.cos(np.radians(STANDING.same_direction))
"""Cosine above which two directions count as one: a rough mesh has many neighbouring stable sides."""
_SHOWN = 6
"""Directions that an error message lists."""

Direction = Float64[np.ndarray, "3"]
Pose = Float64[np.ndarray, "4 4"]


def axis_of(top: Top) -> Direction:
    """The axis of the mesh that "object:-y" names."""
    axis = np.zeros(3)
    axis["xyz".index(top[-1])] = -1.0 if "-" in top else 1.0
    return axis


def find_resting_up(
    session: CaptureSession,
    T_session_object: Float64[np.ndarray, "frames 4 4"],
    rests: Sequence[tuple[int, int]],
    mesh: ObjectMesh,
    points: Float64[np.ndarray, "points 3"] | None,
) -> tuple[Direction, str]:
    """Return up in the session's world (unit vector) and a sentence that says how it was found.

    The object is taken to stand on one of its stable sides in every rest, which leaves a few candidate
    directions. Of these the one is returned whose floor the depth maps show under the object; else the
    one along the y or z axis of the world, if the format says that one of them is up; else the only one.

    Args:
        session: what the phone logged, without gravity.
        T_session_object: the object at 30 fps.
        rests: (start, stop) of its rests, at least one.
        mesh: the object.
        points: of depth maps, session's world, metres; None where there are none.

    Raises:
        InputError: "gravity-ambiguous" when several directions are left, or none.
    """
    poses = [_mean(T_session_object[start:stop]) for start, stop in rests]
    found = _standing_ups(poses, standing_sides(mesh))
    when = ", ".join(f"{start / FPS:.1f} to {stop / FPS:.1f} s" for start, stop in rests[:3])
    floors = [
        up for up in (_floor_normal(points, poses, mesh, up) for up in found) if up is not None
    ]
    if len(floors) == 1:
        return floors[0], "Up is taken from the floor that the depth maps show under the object."
    along = [axis for axis in _world_axes(session) if any(up @ axis > _ONE_ANSWER for up in found)]
    if len(along) == 1:
        name = "xyz"[int(np.argmax(along[0]))]
        note = f"{name} is taken to be up: in that world the object stands where it rests ({when})."
        return along[0], note
    if len(found) == 1:
        return found[0], f"Up is where the object can stand in one way only, at rest ({when})."
    raise _question(session, found, poses[0], when)


def standing_ups(
    T_session_object: Float64[np.ndarray, "frames 4 4"],
    rests: Sequence[tuple[int, int]],
    mesh: ObjectMesh,
) -> list[Direction]:
    """The directions (unit, session's world) that can be up so that the object stands in every rest."""
    poses = [_mean(T_session_object[start:stop]) for start, stop in rests]
    return _standing_ups(poses, standing_sides(mesh))


def _mean(T: Float64[np.ndarray, "frames 4 4"]) -> Pose:
    """Mean pose of a rest; its rotation is the one nearest to the mean."""
    mean = T.mean(axis=0)
    mean[:3, :3] = nearest_rotation(mean[:3, :3])
    return mean


def _standing_ups(poses: Sequence[Pose], sides: Float64[np.ndarray, "sides 3"]) -> list[Direction]:
    """The directions that can be up so that the object stands in every rest, one for each answer."""
    if len(sides) == 0:
        return []
    ups = -sides @ poses[0][:3, :3].T
    ups = ups[[_stands_in_all(up, poses, sides) for up in ups]]
    if len(ups) == 0:
        return []
    count, label = connected_components(ups @ ups.T > _ONE_ANSWER, directed=False)
    # The side on which the object stands most firmly of neighbouring ones is not known: their mean.
    means = [ups[label == k].mean(axis=0) for k in range(count)]
    return [mean / np.linalg.norm(mean) for mean in means]


def _stands_in_all(
    up: Direction, poses: Sequence[Pose], sides: Float64[np.ndarray, "sides 3"]
) -> bool:
    upright = shortest_turn(up, np.array([0.0, 0.0, 1.0]))
    return all(tilt_from_standing(upright @ T[:3, :3], sides)[0] < STANDING.lean for T in poses)


def _floor_normal(
    points: Float64[np.ndarray, "points 3"] | None,
    poses: Sequence[Pose],
    mesh: ObjectMesh,
    up: Direction,
) -> Direction | None:
    """The normal of the plane that the object would stand on; None where the depth maps show none."""
    if points is None:
        return None
    plane = fit_plane(points, up, np.radians(STANDING.lean))
    if plane is None:
        return None
    corners = mesh.vertices.astype(np.float64)
    heights = [
        float((corners @ T[:3, :3].T + T[:3, 3]).dot(plane.normal).min()) - plane.offset
        for T in poses
    ]
    return (
        plane.normal
        if min(map(abs, heights)) < STANDING.floor_distance
        and min(heights) > -STANDING.floor_distance
        else None
    )


def _world_axes(session: CaptureSession) -> list[Direction]:
    """The axes of the world of which one is up: y and z, or none if the format does not say so."""
    return [np.eye(3)[1], np.eye(3)[2]] if session.world_axes else []


def _question(
    session: CaptureSession, found: Sequence[Direction], first: Pose, when: str
) -> InputError:
    """The error that lists the candidate directions and says how to choose one."""
    fix = (
        "Say which axis of the mesh is up where the object rests, e.g. --up object:z (or x, y, -x, -y, "
        "-z), or give up in the session's world, e.g. --up 0,1,0."
    )
    where = f"{session.source}, at rest {when}"
    if not found:
        what = "the object cannot stand by itself as it rests there, if the mesh and the mount are right."
        return InputError(
            "gravity-ambiguous", f"{_silent(session)}, and {what}", where=where, fix=fix
        )
    ways = ", ".join(_in_words(up, first) for up in found[:_SHOWN])
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return InputError(
        "gravity-ambiguous",
        f"{_silent(session)}, and the object can stand on {len(found)} of its sides where it rests: "
        f"{ways}{more}.",
        where=where,
        fix=fix,
    )


def _silent(session: CaptureSession) -> str:
    return f"{session.app} does not log which way is up"


def _in_words(up: Direction, T_session_object: Pose) -> str:
    """The axis of the mesh that would be up, and up in the session's world."""
    local = T_session_object[:3, :3].T @ up
    k = int(np.argmax(np.abs(local)))
    axis = f"{'-' if local[k] < 0 else ''}{'xyz'[k]}"
    numbers = ",".join(f"{x + 0.0:.2f}" for x in up.round(2))
    return f"{axis} of the mesh up (--up {numbers})"
