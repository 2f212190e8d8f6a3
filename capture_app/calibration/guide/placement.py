"""Where a mount puts the phone on the object, in words that a look at the clamp can check."""

from collections.abc import Sequence

import igl
import numpy as np
from jaxtyping import Float64

from ingest.calibration.drawing import body_of_camera
from ingest.mount import Mount
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh

_OBLIQUE = np.radians(25.0)
"""Off an axis by more, a direction is said to lie between two."""


def where_it_sits(mount: Mount, mesh: ObjectMesh) -> str:
    """The phone by the object's own axes.

    Args:
        mount: of the phone.
        mesh: of the object, in metres: the mount's `object_scale` is in it already.
    """
    T_object_phone = inverse(mount.T_phone_object)
    place = T_object_phone[:3, 3]
    R_object_body = body_of_camera(T_object_phone[:3, :3])
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    reach = np.ptp(mesh.vertices, axis=0) / 2
    side = (place - middle) / np.maximum(reach, 1e-3)
    axis = int(np.abs(side).argmax())
    x, y, z = 100 * place
    return (
        f"the lens is on the object's {_named(np.sign(side[axis]) * np.eye(3)[axis])} side, "
        f"{100 * off_surface(mesh, place[None])[0]:.0f} cm from its surface, at x {x:.0f}, y {y:.0f}, "
        f"z {z:.0f} cm; the screen faces {_named(R_object_body[:, 2])}, the top edge points "
        f"{_named(R_object_body[:, 1])}"
    )


def off_surface(mesh: ObjectMesh, points: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, " n"]:
    """How far points are from the object's surface, metres."""
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    found = igl.signed_distance(points, vertices, faces, sign_type=kind)[0]
    return np.abs(np.asarray(found, np.float64)).reshape(-1)


def astray(
    mesh: ObjectMesh, names: Sequence[str], points: Float64[np.ndarray, "n 3"], far: float
) -> tuple[str, ...]:
    """A doubt about the point that is farthest from the surface, if that is far.

    Args:
        mesh: of the object.
        names: of the points.
        points: in the object's frame, metres.
        far: metres.
    """
    off = off_surface(mesh, points)
    worst = int(off.argmax())
    if off[worst] < far:
        return ()
    return (
        f"'{names[worst]}' is {100 * off[worst]:.0f} cm from the mesh's surface. Measure in the "
        "mesh's own axes, in metres: Blender, for one, turns an OBJ on import unless you choose Y "
        "forward and Z up.",
    )


def _named(direction: Float64[np.ndarray, "3"]) -> str:
    """The nearest axis with its sign, or the two nearest."""
    order = np.argsort(-np.abs(direction))
    names = [f"{'-' if direction[k] < 0 else '+'}{'xyz'[k]}" for k in order[:2]]
    if np.arccos(np.abs(direction[order[0]]).clip(0, 1)) < _OBLIQUE:
        return names[0]
    return f"between {names[0]} and {names[1]}"
