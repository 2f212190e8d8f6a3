"""Mount: the one rigid transform that everything hangs on, and what is known of its error."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from omomo_core.motion import ObjectMesh


@dataclass(frozen=True)
class Mount:
    """The constant pose of the object in the ARKit camera frame of the phone clamped to it."""

    T_phone_object: Float64[np.ndarray, "4 4"]
    """Maps object-frame points into the phone's camera frame (x right, y up, z to the viewer)."""
    method: str
    """How it was found, e.g. "board"."""
    covariance: Float64[np.ndarray, "6 6"] | None = None
    """Covariance of the rotation vector (rad) by which the true rotation follows this one, then of the
    translation (m), both in the phone's axes: R_true = exp(r) R, t_true = t + d. None when nobody
    can tell."""
    residuals: dict[str, float] = field(default_factory=dict[str, float])
    """What the method left over, by name with its unit, e.g. {"rms_mm": 3.1}."""
    free: tuple[str, ...] = ()
    """What the recording could not show, in words; those directions hold a guess."""
    note: str = ""
    date: str = ""
    """Day it was found, as 2026-11-21."""
    phone: str = ""
    """Model of the phone, e.g. "iPhone 15 Pro"."""
    object_id: str = ""
    """Id of the mesh it was found for: `object_id`."""
    object_scale: float = 1.0
    """The mesh's vertices times this are metres."""
    picture: str = ""
    """Name of a picture that shows it, beside the mount file."""


def identity_mount() -> Mount:
    """The phone's own frame is the object's."""
    return Mount(np.eye(4), "identity")


def object_id(mesh: ObjectMesh, scale: float = 1.0) -> str:
    """The mesh's name and the box around it in the frame of its file, to a centimetre.

    Another mesh of the same thing in the same frame (a coarser one) has the same id.

    Args:
        mesh: the object.
        scale: what its vertices were multiplied by when the mount's `object_scale` was heeded.
    """
    # Nanometres are dropped so that a side that was scaled and scaled back is rounded as before.
    vertices = np.round(mesh.vertices / scale, 9)
    low, high = (np.round(100 * f(vertices, axis=0)).astype(int) for f in (np.min, np.max))
    size = " x ".join(str(side) for side in high - low)
    return f"{mesh.name}, {size} cm from {' '.join(str(x) for x in low)}"
