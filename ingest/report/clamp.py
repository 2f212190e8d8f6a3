"""Whether the mount can be that of a phone clamped to this object."""

import igl
import numpy as np

from ingest.mount.mount import Mount
from ingest.report.check import Check, grade, graded, worst
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh

_FAR, _TOO_FAR = 0.3, 2.0
"""Metres between the phone's camera and the surface: a clamp's arm, and no clamp."""
_DEEP = 0.05
"""Metres that the camera may be inside a rough mesh."""
_LIMITS = {"mm": (35.0, 100.0), "m": (0.035, 0.1), "deg": (3.0, 15.0)}
"""Residuals to warn of, and not to believe; good calibrations leave 5 to 30 mm, 0.4 to 2 deg."""
_FIX = (
    "Calibrate the mount again; written by hand, it maps points of the mesh into the camera's "
    "axes (not the other way round), in metres."
)


def mount_checks(mesh: ObjectMesh, mount: Mount) -> list[Check]:
    """Where the mount puts the phone, and what its calibration left over."""
    return [_place(mesh, mount), _residuals(mount)]


def _place(mesh: ObjectMesh, mount: Mount) -> Check:
    phone = inverse(mount.T_phone_object)[None, :3, 3]
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    distance = np.asarray(igl.signed_distance(phone, vertices, faces, sign_type=kind)[0]).item()
    turns = np.asarray(igl.fast_winding_number(vertices, faces, phone)).item()
    if abs(turns) > 0.5 and distance > _DEEP:
        message = f"the phone's camera would be {distance:.2f} m inside the object"
        return Check("phone on the object", "warn", message, fix=_FIX)
    severity = grade(distance, _FAR, _TOO_FAR)
    message = f"the phone's camera is {distance:.2f} m from the object's surface"
    return graded("phone on the object", severity, message, _FIX)


def _residuals(mount: Mount) -> Check:
    """By the unit at the end of each name, e.g. rms_mm; other units are shown, not judged."""
    if not mount.residuals:
        return Check("mount", "ok", f"{mount.method}; its file tells no residuals")
    severity = worst(
        [
            grade(abs(value), *_LIMITS[unit])
            for name, value in mount.residuals.items()
            if (unit := name.rpartition("_")[2]) in _LIMITS
        ]
    )
    told = ", ".join(f"{name} {value:.3g}" for name, value in mount.residuals.items())
    return graded("mount", severity, f"{mount.method}; {told}", _FIX)
