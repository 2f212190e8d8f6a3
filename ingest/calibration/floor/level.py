"""Height of the floor in a session's world, and the evidence for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

from ingest.calibration.floor.contacts import Contact, PhoneTrack
from ingest.session import CaptureSession
from ingest.trajectory.depth_points import depth_points
from ingest.trajectory.plane import fit_plane
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import apply

_TAPE = 0.005
"""Metres by which a height measured by hand is off."""
_DEPTH = 0.01
_UNKNOWN = 10.0
_MAX_TILT = np.radians(5)
_LOWEST, _HIGHEST = 0.02, 3.0
"""Metres of a camera over the floor on a thing that stands on it."""


@dataclass(frozen=True)
class FloorLevel:
    """The floor's height in the session's world turned z up."""

    height: float
    sd: float
    """Metres; ten where nothing tells."""
    source: Literal["given", "tape", "depth", "unknown"]
    place: Float64[np.ndarray, "2"]
    """x and y where it is so high; elsewhere a tilted world makes it another height."""
    path: float
    """Metres the phone had gone by then; tracking drifts from there."""


def floor_level(
    session: CaptureSession,
    seen: PhoneTrack,
    contacts: Sequence[Contact],
    phone_height: float | None,
    floor: float | None,
) -> FloorLevel:
    """The floor as given, as measured from the camera down, or as depth maps show it.

    Args:
        session: what the phone logged.
        seen: the same at 30 fps.
        contacts: at least one; the camera's height is that of the first rest among them.
        phone_height: metres of the lens over the floor then.
        floor: its height in the session's world, metres.

    Raises:
        InputError: "floor-twice", "floor-height".
    """
    if phone_height is not None and floor is not None:
        raise InputError(
            "floor-twice",
            "The floor is given twice: by the phone's height over it, and in the session's world.",
            where="--phone-height, --floor",
            fix="Give the one you measured.",
        )
    if floor is not None:
        return FloorLevel(floor, _TAPE, "given", np.zeros(2), 0.0)
    first = min(contacts, key=lambda contact: (contact.kind != "rest", contact.start))
    if phone_height is not None:
        if not _LOWEST <= phone_height <= _HIGHEST:
            raise InputError(
                "floor-height",
                f"The phone cannot be {phone_height:g} m over the floor.",
                where="--phone-height",
                fix="Measure from the floor up to the lens of the wide camera, in metres.",
            )
        height = first.height - phone_height
        return FloorLevel(height, _TAPE, "tape", first.place[:2], first.path)
    shown = _shown(session, seen, first)
    if shown is not None:
        return FloorLevel(shown, _DEPTH, "depth", first.place[:2], first.path)
    return FloorLevel(first.height, _UNKNOWN, "unknown", first.place[:2], first.path)


def _shown(session: CaptureSession, seen: PhoneTrack, first: Contact) -> float | None:
    """Height, at the first contact, of the largest level plane below the phone."""
    points = depth_points(session, seen.valid)
    if points is None:
        return None
    upright = apply(seen.T_zup_session[None], points)[0]
    below = upright[upright[:, 2] < first.height - _LOWEST]
    plane = fit_plane(below, np.array([0.0, 0.0, 1.0]), _MAX_TILT)
    if plane is None:
        return None
    return float((plane.offset - plane.normal[:2] @ first.place[:2]) / plane.normal[2])
