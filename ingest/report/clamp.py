"""Whether the mount can be that of a phone clamped to this object."""

import igl
import numpy as np

from ingest.mount import Mount, object_id
from ingest.report.check import Check, grade, graded, worst
from ingest.uncertainty import bounds_95
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh

_FAR, _TOO_FAR = 0.3, 0.5
"""Metres between the phone's camera and the surface: a clamp's arm, and no clamp."""
_DEEP, _TOO_DEEP = 0.03, 0.06
"""Metres that the camera may seem to be inside a rough mesh, and where no phone can be."""
_LIMITS = {"mm": (35.0, 100.0), "m": (0.035, 0.1), "deg": (3.0, 15.0)}
"""Residuals to warn of, and not to believe; good calibrations leave 5 to 30 mm, 0.4 to 2 deg."""
_WIDE_MM, _WIDE_DEG = 30.0, 5.0
"""95 % bounds of a mount beyond which hands are seen to miss the object."""
_FIX = (
    "Calibrate the mount again; written by hand, it maps points of the mesh into the camera's "
    "axes (not the other way round), in metres."
)


def mount_checks(mesh: ObjectMesh, mount: Mount) -> list[Check]:
    """Where the mount puts the phone, what its calibration left over, and how sure it is.

    Args:
        mesh: the object, in metres: the mount's `object_scale` is in it already.
        mount: the mount of the take.
    """
    return [_place(mesh, mount), _residuals(mount), *_object(mesh, mount), *_sureness(mount)]


def _place(mesh: ObjectMesh, mount: Mount) -> Check:
    phone = inverse(mount.T_phone_object)[None, :3, 3]
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    distance = np.asarray(igl.signed_distance(phone, vertices, faces, sign_type=kind)[0]).item()
    turns = np.asarray(igl.fast_winding_number(vertices, faces, phone)).item()
    if abs(turns) > 0.5 and distance > _DEEP:
        message = f"the phone's camera would be {distance:.2f} m inside the object"
        return graded("phone on the object", grade(distance, _DEEP, _TOO_DEEP), message, _FIX)
    severity = grade(distance, _FAR, _TOO_FAR)
    message = f"the phone's camera is {distance:.2f} m from the object's surface"
    return graded("phone on the object", severity, message, _FIX)


def _residuals(mount: Mount) -> Check:
    """Judge residuals by the unit at the end of their names, e.g. rms_mm; show those of other units.

    Drift is not judged either: it has been taken out, and it grows with the walk.
    """
    if not mount.residuals:
        return Check("mount", "ok", f"{mount.method}; its file tells no residuals")
    severity = worst(
        [
            grade(abs(value), *_LIMITS[unit])
            for name, value in mount.residuals.items()
            if (unit := name.rpartition("_")[2]) in _LIMITS and not name.startswith("drift")
        ]
    )
    facts = ", ".join(f"{name} {value:.3g}" for name, value in mount.residuals.items())
    return graded("mount", severity, f"{mount.method}; {facts}", _FIX)


def _object(mesh: ObjectMesh, mount: Mount) -> list[Check]:
    """Check that the mount was calibrated for this mesh, if its file names the mesh."""
    if not mount.object_id:
        return []
    given = object_id(mesh, mount.object_scale)
    if given == mount.object_id:
        return [Check("mount's object", "ok", given)]
    message = f"the mount was found for another mesh: {mount.object_id}; this one is {given}"
    fix = (
        "Give the mesh it was found for, or calibrate with this one: a mesh in another frame, or of "
        "another size, needs a mount of its own."
    )
    return [Check("mount's object", "bad", message, fix=fix)]


def _sureness(mount: Mount) -> list[Check]:
    """Check of the mount's covariance, if it has one, and of the directions that stayed open."""
    if mount.covariance is None and not mount.free:
        return []
    facts: list[str] = []
    wide = bool(mount.free)
    if mount.covariance is not None:
        bounds = bounds_95(mount.covariance)
        wide |= bounds.mm > _WIDE_MM or bounds.deg > _WIDE_DEG
        facts.append(f"right within {bounds.mm:.0f} mm and {bounds.deg:.1f} deg (95 %)")
    if mount.free:
        facts.append(f"a guess: {', '.join(mount.free)}")
    fix = (
        "Calibrate in another way too and combine the two (omocap calibrate combine), or let the "
        "floor refine it (omocap calibrate floor)."
    )
    return [graded("mount's error", "warn" if wide else "ok", "; ".join(facts), fix)]
