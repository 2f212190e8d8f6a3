"""The mount from points measured both on the phone and on the object."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.calibration.phone_body import LENS, Phone, body_point, phone_body
from ingest.calibration.point_pairs import PointFit, PointPair, rigid_from_points
from ingest.mount import Mount
from ingest.uncertainty import of_product
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

MAX_OFFSET = 5.0
"""Metres; a point of the phone farther from its camera is in another unit."""
_LENS_GLASS = 0.003
"""Metres, one sigma: who measures "the lens" touches its glass, in front of the optical centre."""


class Picked(NamedTuple):
    """A mount from points, and how each pair fits."""

    mount: Mount
    fit: PointFit


def mount_from_pairs(
    pairs: Sequence[PointPair], phone: Phone | None = None, *, scaled: bool = False
) -> Picked:
    """Solve for the mount, and for the mesh's scale if asked.

    The phone's own sizes (where its lens is) are one error shared by all named points: it is in the
    covariance once, however many points there are.

    Args:
        pairs: three or more.
        phone: needed where points of the phone are named.
        scaled: also find the factor that brings the mesh to metres.

    Raises:
        InputError: "phone-needed", "points-units", or as `rigid_from_points` and `body_point`.
    """
    b = np.array([pair.object for pair in pairs], float).reshape(-1, 3)
    sigma = np.array([pair.sigma for pair in pairs], float)
    names = [pair.name for pair in pairs]
    named = [isinstance(pair.phone, str) for pair in pairs]
    if not any(named):
        a = _camera_points([pair.phone for pair in pairs])
        fit = rigid_from_points(a, b, sigma, scaled=scaled, names=names)
        return Picked(_mount(fit, fit.T_a_b, fit.covariance, names, phone), fit)
    if phone is None:
        raise InputError(
            "phone-needed",
            f"'{names[named.index(True)]}' is a point of the phone, but its model is not given.",
            field="phone",
            fix='Pass ‹phone› "iPhone 15", or give the point as three numbers.',
        )
    T_phone_body, covariance = phone_body(phone)
    a = np.array([_in_body(pair.phone, phone, T_phone_body) for pair in pairs])
    lens = np.array([pair.phone == LENS for pair in pairs])
    sigma = np.hypot(sigma, np.where(lens, _LENS_GLASS, 0.0))
    fit = rigid_from_points(a, b, sigma, scaled=scaled, names=names)
    total = of_product(T_phone_body, covariance, fit.T_a_b, fit.covariance)
    return Picked(_mount(fit, T_phone_body @ fit.T_a_b, total, names, phone), fit)


def _camera_points(points: Sequence[object]) -> Float64[np.ndarray, "n 3"]:
    a = np.array(points, float).reshape(-1, 3)
    farthest = float(np.abs(a).max(initial=0))
    if farthest > MAX_OFFSET:
        raise InputError(
            "points-units",
            f"A point measured from the phone's camera is {farthest:g} m away.",
            fix="Give metres; this looks like millimetres or centimetres.",
        )
    return a


def _in_body(
    point: object, phone: Phone, T_phone_body: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "3"]:
    if isinstance(point, str):
        return body_point(phone, point)
    T = inverse(T_phone_body)
    return T[:3, :3] @ _camera_points([point])[0] + T[:3, 3]


def _mount(
    fit: PointFit,
    T: Float64[np.ndarray, "4 4"],
    covariance: Float64[np.ndarray, "6 6"],
    names: Sequence[str],
    phone: Phone | None,
) -> Mount:
    return Mount(
        T,
        "points",
        covariance=covariance,
        residuals={"rms_mm": 1e3 * fit.rms, "worst_mm": 1e3 * float(fit.residuals[fit.kept].max())},
        note=" ".join(_notes(fit, names)),
        phone=phone.name if phone else "",
        object_scale=fit.scale,
    )


def _notes(fit: PointFit, names: Sequence[str]) -> list[str]:
    notes = [
        f"'{name}' was left out: it is {1e3 * off:.0f} mm from where the others put it."
        for name, off, kept in zip(names, fit.residuals, fit.kept, strict=True)
        if not kept
    ]
    if fit.loose:
        notes.append("The pairs fit worse than stated; the bounds follow how they fit.")
    if fit.flat:
        notes.append(
            "The points are flat: if one of the frames were left-handed, nothing would show it. "
            "A point out of their plane would."
        )
    return notes
