"""Rests of the object, the poses in which it can stand, and which axis they show to be up.

A tracker's noise moves every single pose, so what is judged is a moving average: over one frame in a
quiet log, and over as many as a noisy one needs.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Float64
from scipy.ndimage import uniform_filter1d
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from ingest.session import CaptureSession
from ingest.trajectory.plane import fit_plane
from ingest.trajectory.trajectory_config import RESTS, STANDING, Top
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import frame_noise, nearest_rotation, shortest_turn
from omomo_core.motion import FPS, ObjectMesh

Poses = Float64[np.ndarray, "frames 3 4"]
"""Rotations and positions side by side."""


def find_rests(
    T: Float64[np.ndarray, "frames 4 4"], valid: Bool[np.ndarray, " frames"]
) -> list[tuple[int, int]]:
    """(start, stop) of the frames at 30 fps in which the origin of T and its axes stand still."""
    width = round(RESTS.shortest * FPS) + 1
    if len(T) < width:
        return []
    noise = frame_noise(T, valid, RESTS.quiet_share)
    averaged = _frames_to_average(noise)
    mean = _averaged(T[:, :3], valid, averaged)
    windows = np.lib.stride_tricks.sliding_window_view
    still = (
        np.linalg.norm(np.ptp(windows(mean[..., 3], width, axis=0), axis=-1), axis=1)
        < RESTS.largest_spread
    )
    still &= windows(valid, width).all(axis=-1)
    still &= _turns(mean[..., :3], width) < np.radians(RESTS.largest_turn)
    if averaged > 1:
        still &= _is_noise(T[:, :3] - mean, noise, width)
    resting = np.zeros(len(T), bool)
    for start in np.flatnonzero(still):
        resting[start : start + width] = True
    return runs(resting)


def is_steady(
    T: Float64[np.ndarray, "frames 4 4"], noise: tuple[float, float] = (0.0, 0.0)
) -> bool:
    """Whether a rest is too steady for hands: the thing stands, on the floor or on something else.

    Args:
        T: the poses of the rest.
        noise: of the log, as `frame_noise` has it; it is no trembling.
    """
    shift = np.linalg.norm(T[:, :3, 3].std(axis=0))
    # A small turn moves the three columns of a rotation by sqrt(2) times its angle in all.
    turn = np.linalg.norm(T[:, :3, :3].std(axis=0)) / np.sqrt(2)
    close = shift < np.hypot(RESTS.steady_shift, RESTS.steady_noise * noise[0])
    return bool(
        (close or _creeps(T[:, :3, 3], float(shift), noise[0]))
        and turn < np.hypot(np.radians(RESTS.steady_turn), RESTS.steady_noise * noise[1])
    )


def _creeps(place: Float64[np.ndarray, "frames 3"], shift: float, noise: float) -> bool:
    """Whether a place wanders as slowly as a tracker does: a hand that goes as far trembles."""
    width = round(RESTS.creep_window * FPS)
    if shift > RESTS.creep_shift or len(place) < 2 * width:
        return False
    mean = uniform_filter1d(place, width, axis=0)
    trembling = np.linalg.norm((place - mean).std(axis=0))
    if trembling > np.hypot(RESTS.steady_shift, RESTS.steady_noise * noise):
        return False
    mean = mean[width // 2 : -(width // 2) or None]
    pace = np.diff(mean[::width], axis=0) / RESTS.creep_window
    allowed = np.hypot(
        RESTS.creep_pace, RESTS.steady_noise * noise / RESTS.creep_window / np.sqrt(width / 2)
    )
    return len(pace) > 0 and bool(np.sqrt((pace**2).sum(axis=1).mean()) < allowed)


def _frames_to_average(noise: tuple[float, float]) -> int:
    """How many frames bring the noise down to what an average may keep; odd."""
    needed = max(noise[0] / RESTS.kept_noise, noise[1] / np.radians(RESTS.kept_turn_noise)) ** 2
    return int(min(max(1, needed), RESTS.most_averaged)) // 2 * 2 + 1


def _averaged(T: Poses, valid: Bool[np.ndarray, " frames"], count: int) -> Poses:
    """Moving average over so many frames, those that are not valid left out.

    Averages of rotations are a little shorter than rotations: 1 part in 10,000 at 1 degree of noise.
    """
    if count == 1:
        return T
    weight = uniform_filter1d(valid.astype(float), count)[:, None, None].clip(1e-9)
    return uniform_filter1d(np.where(valid[:, None, None], T, 0.0), count, axis=0) / weight


def _is_noise(left: Poses, noise: tuple[float, float], width: int) -> Bool[np.ndarray, " windows"]:
    """Whether what an average took out of each window is no more than the log's noise."""
    windows = np.lib.stride_tricks.sliding_window_view
    shift = np.sqrt(windows((left[..., 3] ** 2).sum(axis=1), width).mean(axis=1) / 3)
    turn = np.sqrt(windows((left[..., :3] ** 2).sum(axis=(1, 2)), width).mean(axis=1) / 6)
    return (shift < np.hypot(RESTS.shaking * noise[0], RESTS.kept_noise)) & (
        turn < np.hypot(RESTS.shaking * noise[1], np.radians(RESTS.kept_turn_noise))
    )


def _turns(R: Float64[np.ndarray, "frames 3 3"], width: int) -> Float64[np.ndarray, " windows"]:
    """Largest angle (rad) between each frame and the width-1 frames after it."""
    count = len(R) - width + 1
    largest = np.zeros(count)
    for k in range(1, width):
        # The chord of two rotations: |A - B|_F = 2 sqrt(2) sin(angle / 2).
        chord = np.linalg.norm(R[k : k + count] - R[:count], axis=(1, 2)) / np.sqrt(8)
        largest = np.maximum(largest, 2 * np.arcsin(np.minimum(chord, 1)))
    return largest


def standing_sides(mesh: ObjectMesh) -> Float64[np.ndarray, "sides 3"]:
    """Directions (unit, object frame) that may point down while the object stands by itself.

    The normals of the convex hull whose support has the centre of the hull above it. Round things
    have many, flat meshes none.
    """
    vertices = mesh.vertices.astype(np.float64)
    try:
        hull = ConvexHull(vertices)
    except QhullError:
        return np.empty((0, 3))
    corners = vertices[hull.vertices]
    centre = corners.mean(axis=0)
    normals = np.unique(hull.equations[:, :3].round(2), axis=0)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    slack = STANDING.flatness * float(np.ptp(corners, axis=0).max())
    return np.array([n for n in normals if _stands(corners, centre, n, slack)]).reshape(-1, 3)


def _stands(
    corners: Float64[np.ndarray, "corners 3"],
    centre: Float64[np.ndarray, "3"],
    down: Float64[np.ndarray, "3"],
    slack: float,
) -> bool:
    """Whether the centre is above the support: seen from it, no half turn is without a foot."""
    depth = corners @ down
    feet = corners[depth > depth.max() - slack] - centre
    across = np.linalg.svd(down[None])[2][1:]
    angles = np.sort(np.arctan2(*(feet @ across.T).T))
    gaps = np.diff(np.concatenate([angles, angles[:1] + 2 * np.pi]))
    return bool(gaps.max() < np.pi)


def tilt_from_standing(
    R_world_object: Float[np.ndarray, "3 3"], sides: Float64[np.ndarray, "sides 3"]
) -> tuple[float, int]:
    """Degrees between a pose (world z up) and the nearest one in which it stands, and its side."""
    cosines = sides @ -R_world_object[2]
    side = int(np.argmax(cosines))
    return float(np.degrees(np.arccos(np.clip(cosines[side], -1, 1)))), side


_ONE_ANSWER = np.cos(np.radians(STANDING.same_direction))
"""Cosine above which two directions count as one: a rough mesh has many neighbouring stable sides."""
_EACH, _LOOKED_AT = 7, 200
"""Every so many vertices tell how low an object is, in so many frames of a take."""
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
    usable: Bool[np.ndarray, " frames"],
    mesh: ObjectMesh,
    points: Float64[np.ndarray, "points 3"] | None,
) -> tuple[Direction, str]:
    """Return up in the session's world (unit vector) and a sentence that says how it was found.

    The object is taken to stand on one of its stable sides in every rest, which leaves a few candidate
    directions, and those are dropped in which it would go below the floor or higher than people reach. Of
    the others the one is returned whose floor the depth maps show under the object; else the one along the
    y or z axis of the world, if the format says that one of them is up; else the only one.

    Args:
        session: what the phone logged, without gravity.
        T_session_object: the object at 30 fps.
        rests: (start, stop) of its rests, at least one.
        usable: which frames are tracked.
        mesh: the object.
        points: of depth maps, session's world, metres; None where there are none.

    Raises:
        InputError: "gravity-ambiguous" when several directions are left, or none.
    """
    poses = [_mean(T_session_object[start:stop]) for start, stop in rests]
    stood = _standing_ups(poses, standing_sides(mesh))
    found = [up for up in stood if _within_reach(up, T_session_object[usable], poses, mesh)]
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
    raise _question(session, found or stood, poses[0], when)


def _within_reach(
    up: Direction, T: Float64[np.ndarray, "frames 4 4"], poses: Sequence[Pose], mesh: ObjectMesh
) -> bool:
    """Whether the object stays over the floor that it rests on, and no higher than people lift things."""
    corners = mesh.vertices[::_EACH].astype(np.float64)

    def lowest(place: Pose) -> float:
        return float((corners @ (up @ place[:3, :3])).min() + up @ place[:3, 3])

    floor = min(map(lowest, poses))
    heights = np.array([lowest(place) for place in T[:: max(1, len(T) // _LOOKED_AT)]]) - floor
    dip = STANDING.dip * (1 + float(np.ptp(corners, axis=0).max()))
    return bool(heights.min() > -dip and heights.max() < STANDING.reach)


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
        "Say which axis of the mesh is up where the object rests, e.g. ‹up› object:z (or x, y, -x, -y, "
        "-z), or give up in the session's world, e.g. ‹up› 0,1,0."
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
    return f"{axis} of the mesh up (‹up› {numbers})"
