"""Checks of the phone's place: at the object's surface, not inside it, its view free, above the floor.

A mount that is turned, moved, the other way round or of another mesh puts a phone where none can be. A
phone is a plate of 15 x 7.5 cm about its camera: much of a wrong mount shows in the plate alone.
"""

from typing import NamedTuple

import igl
import numpy as np
import trimesh
from jaxtyping import Float64

from ingest.mount import Mount
from ingest.report.take_report import Check, grade, graded, worst
from ingest.trajectory.object_motion import ObjectTake
from omomo_core.geometry.surface import inside_mesh
from omomo_core.geometry.transforms import apply, inverse
from omomo_core.motion import ObjectMesh

_ABOVE, _BELOW, _LEFT, _RIGHT = 0.012, 0.135, 0.012, 0.06
"""Metres from the main camera to the edges of a phone in portrait, seen from behind."""
_ACROSS, _ALONG = 4, 7
"""Points of the plate in its two directions."""
_FAR, _TOO_FAR = 0.08, 0.4
"""Metres between the phone and the surface: a clamp's arm, and no clamp."""
_FAR_MEASURED = 0.25
"""The first of these where the mount was calibrated, so that its errors are known."""
_DEEP, _TOO_DEEP = 0.02, 0.05
"""Metres that the phone may seem to be inside a rough mesh, and where no phone can be."""
_SIGHT = 0.5
"""Metres before the camera within which the object hides the room."""
_VIEW = (0.45, 0.6)
"""Tangents of half the angles of view, of the width and of the height in portrait."""
_HIDDEN, _BLIND = 0.4, 0.95
"""Share of the view that the object may fill, and with which nothing can be tracked."""
_UNDER, _FAR_UNDER = 0.03, 0.1
"""Metres that the phone may seem to go into the floor, and that none does."""
_FIX = (
    "Check mesh and mount against the picture of the phone on the object; calibrate the mount again if it is "
    "wrong. ‹mount› maps points of the mesh into the camera's axes (not the other way round), in metres."
)


class PhonePlace(NamedTuple):
    """How a phone is placed at an object."""

    distance: float
    """From the phone's nearest point to the object's surface, metres."""
    depth: float
    """How deep its deepest point is inside the object, metres; 0 outside."""
    hidden: float
    """Share of the camera's view that the object fills, from 0 to 1."""


def phone_plate() -> Float64[np.ndarray, "points 3"]:
    """Points of a phone in ARKit's camera axes: x down the phone in portrait, z out of its screen."""
    x = np.linspace(-_ABOVE, _BELOW, _ALONG)
    y = np.linspace(-_RIGHT, _LEFT, _ACROSS)
    return np.stack([*np.meshgrid(x, y, [0.004], indexing="ij")], axis=-1).reshape(-1, 3)


def phone_place(mesh: ObjectMesh, mount: Mount) -> PhonePlace:
    """Return how the mount places a phone at the object."""
    T_object_phone = inverse(mount.T_phone_object)
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    points = apply(T_object_phone[None], phone_plate())[0]
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    distance = np.asarray(igl.signed_distance(points, vertices, faces, sign_type=kind)[0]).reshape(
        -1
    )
    inside = inside_mesh(mesh, points)
    return PhonePlace(
        float(distance.min()),
        float((distance * inside).max()),
        _hidden(mesh, T_object_phone),
    )


def _hidden(mesh: ObjectMesh, T_object_phone: Float64[np.ndarray, "4 4"]) -> float:
    """Share of rays of the camera that meet the object within a short way."""
    wide, high = (np.linspace(-tangent, tangent, 7) for tangent in _VIEW)
    x, y = np.meshgrid(high, wide, indexing="ij")
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1).reshape(-1, 3) @ T_object_phone[:3, :3].T
    start = np.tile(T_object_phone[:3, 3], (len(rays), 1))
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    places, ray, _ = solid.ray.intersects_location(start, rays, multiple_hits=False)
    near = np.linalg.norm(places - T_object_phone[:3, 3], axis=1) < _SIGHT
    return len(np.unique(ray[near])) / len(rays)


def place_check(mesh: ObjectMesh, mount: Mount) -> Check:
    """Check that a phone can be where the mount puts it."""
    place = phone_place(mesh, mount)
    name = "phone on the object"
    if place.depth > _DEEP:
        message = f"the phone would be {100 * place.depth:.0f} cm inside the object"
        return graded(name, grade(place.depth, _DEEP, _TOO_DEEP), message, _FIX)
    message = f"the phone is {100 * place.distance:.0f} cm from the object's surface"
    arm = _FAR if mount.covariance is None else _FAR_MEASURED
    far = grade(place.distance, arm, _TOO_FAR)
    blind = grade(place.hidden, _HIDDEN, _BLIND)
    if far != "ok":
        message += ", which takes an arm"
    if blind != "ok":
        message += f", and the object would fill {place.hidden:.0%} of its camera's view"
    return graded(name, worst([far, blind]), message, _FIX)


def above_floor_check(take: ObjectTake, mount: Mount) -> Check:
    """Check that the phone stays above the floor, whatever is known of it."""
    T_world_phone = take.motion.T_world_object @ inverse(mount.T_phone_object)
    plate = phone_plate()
    heights = (T_world_phone[:, 2, :3] @ plate.T).min(axis=1) + T_world_phone[:, 2, 3]
    lowest = float(np.percentile(heights[take.motion.valid], 1))
    if lowest > -_UNDER:
        return Check("phone above the floor", "ok", f"by {max(lowest, 0.0):.2f} m and more")
    message = f"the phone would be {-lowest:.2f} m under the floor"
    return graded("phone above the floor", grade(-lowest, _UNDER, _FAR_UNDER), message, _FIX)
