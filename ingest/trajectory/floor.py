"""The floor's height: under the object where it rests, or where depth maps show it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Float64
from scipy.spatial import ConvexHull, QhullError

from ingest.trajectory.plane import fit_plane
from ingest.trajectory.rests import find_rests
from ingest.trajectory.trajectory_config import FLOOR
from omomo_core.motion import FPS, ObjectMesh

_CHUNK = 2**20
"""Heights computed at a time."""


@dataclass(frozen=True)
class Floor:
    """The floor's height and how it is known."""

    height: float
    """Metres along the up axis of the session's world (ARKit's y)."""
    source: Literal["given", "rest", "depth", "elsewhere", "lowest", "assumed"]
    message: str

    @property
    def certain(self) -> bool:
        """Whether it was given or measured; a run refuses what is not, unless it is forced."""
        return self.source in ("given", "rest", "depth")


def find_floor(
    T_zup_object: Float64[np.ndarray, "frames 4 4"],
    valid: Bool[np.ndarray, " frames"],
    mesh: ObjectMesh,
    given: float | None = None,
    points: Float64[np.ndarray, "points 3"] | None = None,
    elsewhere: Bool[np.ndarray, " frames"] | None = None,
) -> Floor:
    """The floor of a stretch, from the object's poses in the session's world turned z up, at 30 fps.

    The object's lowest vertex while it stands still at its lowest level is on the floor. A given
    height (metres, session's world) wins. If the object goes well below where it stood still, or
    the points of depth maps (same world) show a floor well below, it stood on something else. That
    plane of points is used then, or its own lowest point without them. If it never stands still
    and there is no plane, the floor is where it rests elsewhere, in a part of the take whose
    world may be another; without that its centre is assumed to be carried at 1 m. All that is said
    in the message.

    Args:
        T_zup_object: the whole take.
        valid: the tracked frames whose world is that of the stretch.
        mesh: the object.
        given: the floor's height, metres.
        points: of depth maps of the same frames.
        elsewhere: other tracked frames, where the tracker has moved its world.
    """
    if given is not None:
        return Floor(given, "given", f"The floor is at {given:.3f} m, as given.")
    bottom = _lowest_vertex(T_zup_object, mesh)
    seen = _plane_below(points, T_zup_object[valid, :2, 3], float(bottom[valid].min()))
    rests = find_rests(T_zup_object, valid)
    if not rests:
        found = _shown(seen) or _of_another_world(T_zup_object, bottom, elsewhere)
        return found or _assumed(T_zup_object[valid], bottom[valid], mesh)
    height, start, stop = _lowest_rest(bottom, rests)
    deepest = float(np.percentile(bottom[valid], 1))
    size = float(np.ptp(mesh.vertices, axis=0).max())
    if deepest < height - FLOOR.largest_dip * (1 + size):
        return _shown(seen) or _lowest(deepest, height)
    if seen is not None and seen < height - FLOOR.agreement:
        return Floor(
            seen,
            "depth",
            f"The floor is the plane that the depth maps show {height - seen:.2f} m below the place "
            "where the object stands still.",
        )
    when = f"{start / FPS:.1f} to {stop / FPS:.1f} s"
    return Floor(height, "rest", f"The floor is where the object rests ({when}).")


def _plane_below(
    points: Float64[np.ndarray, "points 3"] | None,
    path: Float64[np.ndarray, "frames 2"],
    lowest: float,
) -> float | None:
    """Height, amid the object's path, of the level plane under the object's lowest point."""
    if points is None:
        return None
    below = points[points[:, 2] < lowest + FLOOR.agreement]
    plane = fit_plane(below, np.array([0.0, 0.0, 1.0]), np.radians(FLOOR.largest_tilt))
    if plane is None:
        return None
    return float((plane.offset - plane.normal[:2] @ path.mean(axis=0)) / plane.normal[2])


def _shown(seen: float | None) -> Floor | None:
    if seen is None:
        return None
    return Floor(seen, "depth", "The floor is the plane that the depth maps show below the object.")


def _of_another_world(
    T: Float64[np.ndarray, "frames 4 4"],
    bottom: Float64[np.ndarray, " frames"],
    elsewhere: Bool[np.ndarray, " frames"] | None,
) -> Floor | None:
    """Return the floor where the object rests in a part of the take whose world may be another."""
    rests = [] if elsewhere is None else find_rests(T, elsewhere)
    if not rests:
        return None
    height, start, stop = _lowest_rest(bottom, rests)
    return Floor(
        height,
        "elsewhere",
        f"The object rests only in another part of the take ({start / FPS:.1f} to {stop / FPS:.1f} s), "
        "and tracking was lost in between: the floor may be off by as much as it jumped. Use that part "
        "(‹segment›), or give the height (‹floor›).",
    )


def _lowest(deepest: float, rest: float) -> Floor:
    return Floor(
        deepest,
        "lowest",
        f"The object goes {rest - deepest:.2f} m below the places where it stands still, so its "
        "lowest point is taken as the floor; if it never touched the floor, give its height "
        "(‹floor›).",
    )


def _lowest_rest(
    bottom: Float64[np.ndarray, " frames"], rests: list[tuple[int, int]]
) -> tuple[float, int, int]:
    """Mean height of the lowest rests, weighted by duration, and the first of them."""
    levels = np.array([np.median(bottom[a:b]) for a, b in rests])
    low = np.flatnonzero(levels < levels.min() + FLOOR.same_level)
    weights = np.array([rests[i][1] - rests[i][0] for i in low])
    return float(np.average(levels[low], weights=weights)), *rests[low[0]]


def _assumed(
    T: Float64[np.ndarray, "frames 4 4"], bottom: Float64[np.ndarray, " frames"], mesh: ObjectMesh
) -> Floor:
    centre = (mesh.vertices.max(axis=0) + mesh.vertices.min(axis=0)) / 2
    carried = float(np.median(T[:, 2, :3] @ centre + T[:, 2, 3])) - FLOOR.assumed_height
    # A long object reaches below a centre carried at 1 m: never put it through the floor.
    return Floor(
        min(carried, float(bottom.min())),
        "assumed",
        "The object never stands still, so the floor is a guess: its centre is taken to be "
        f"{FLOOR.assumed_height:g} m above it. Start the take with the object on the floor for a second, "
        "or give the height (‹floor›).",
    )


def _lowest_vertex(
    T: Float64[np.ndarray, "frames 4 4"], mesh: ObjectMesh
) -> Float64[np.ndarray, " frames"]:
    """Height of the lowest vertex in each frame."""
    corners = _hull(mesh.vertices)
    chunks = np.array_split(T[:, 2, :3], len(T) * len(corners) // _CHUNK + 1)
    return np.concatenate([(up @ corners.T).min(axis=1) for up in chunks]) + T[:, 2, 3]


def _hull(vertices: Float[np.ndarray, "verts 3"]) -> Float64[np.ndarray, "corners 3"]:
    points = vertices.astype(np.float64)
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:  # a flat object has no hull; every vertex is a corner then
        return points
