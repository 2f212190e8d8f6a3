"""A look at a mount while somebody is still typing or clicking it: what it implies, in plain words."""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from capture_app.calibration.calibrate import by_drawing, needed_phone, pairs_of
from capture_app.calibration.guide_steps import Finding, astray
from capture_app.commands.calibrate import DrawingWay, PointsWay
from ingest.calibration.phone_body import Phone, body_point
from ingest.calibration.picked_points import mount_from_pairs
from ingest.calibration.point_pairs import PointPair
from ingest.mount import Mount
from ingest.uncertainty import bounds_95
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

ENOUGH = 3
"""Points that give a mount."""
HELD_OFF = 0.3
"""Metres from the surface at which a clamp may hold a point of the phone."""
_APART = 0.01
"""Metres by which two points may be nearer or farther than on the phone."""
_MISFIT = 0.008
"""Metres by which points may be off where the others put them."""


class MountLook(NamedTuple):
    """What can be said of a mount so far."""

    finding: Finding
    mount: Mount | None
    """None where it is not determined."""


def look_at(way: DrawingWay | PointsWay, mesh: ObjectMesh | None) -> MountLook:
    """Return what a form implies, and what speaks against it.

    Args:
        way: what is said so far; of points two or more.
        mesh: the object, in metres, where it is known.

    Raises:
        InputError: the numbers make no pose, the phone is not given, or has no point of such a name.
    """
    if isinstance(way, DrawingWay):
        mount = by_drawing(way)
        return MountLook(Finding("The numbers make a mount", (), _reach(mount, mesh)), mount)
    return look_at_points(pairs_of(way), needed_phone(way.phone, way.ruler), mesh)


def look_at_points(pairs: Sequence[PointPair], phone: Phone, mesh: ObjectMesh | None) -> MountLook:
    """Return how points on the object fit the phone.

    Args:
        pairs: two or more.
        phone: whose points they are.
        mesh: the object, in metres, where it is known.

    Raises:
        InputError: as `body_point`.
    """
    names, places = [pair.name for pair in pairs], np.array([pair.object for pair in pairs])
    doubts = () if mesh is None else astray(mesh, names, places, HELD_OFF)
    apart, is_off = _apart(pairs, phone)
    if len(pairs) < ENOUGH:
        told = () if is_off else apart
        return MountLook(
            Finding(f"{len(pairs)} points", doubts + (apart if is_off else ()), told), None
        )
    try:
        picked = mount_from_pairs(pairs, phone)
    except InputError as error:
        return MountLook(Finding(f"{len(pairs)} points", (*doubts, *apart, error.what)), None)
    fit, mount = picked.fit, picked.mount
    worst = int(fit.residuals.argmax())
    rms, most = 1e3 * fit.rms, 1e3 * float(fit.residuals[worst])
    notes = (*_reach(mount, mesh), *([mount.note] if fit.flat and mount.note else []))
    if fit.loose or not fit.kept.all() or fit.residuals[worst] > _MISFIT:
        doubts += (
            f"The points fit the phone to {most:.0f} mm only; clicked with care they fit to 5 mm. Look at "
            f"'{names[worst]}' first: is it the right corner, and is the object's size right?",
            *(apart if is_off else ()),
        )
    if len(pairs) == ENOUGH:
        notes += ("Three points fit nearly always: a fourth would show a mistake.",)
    good = f"{len(pairs)} points, which fit the phone within {rms:.1f} mm (worst {most:.1f})"
    return MountLook(Finding(good, doubts, notes), mount)


def _apart(pairs: Sequence[PointPair], phone: Phone) -> tuple[tuple[str, ...], bool]:
    """The two points whose distance differs most from that on the phone, and whether it is far off."""
    named = [pair for pair in pairs if isinstance(pair.phone, str)]
    found: list[tuple[float, str]] = []
    for a, b in combinations(named, 2):
        here = float(np.linalg.norm(np.subtract(a.object, b.object)))
        there = float(np.linalg.norm(body_point(phone, a.name) - body_point(phone, b.name)))
        words = (
            f"'{a.name}' and '{b.name}' are {100 * here:.1f} cm apart here, {100 * there:.1f} cm on "
            f"the {phone.name}."
        )
        found.append((abs(here - there), words))
    if not found:
        return (), False
    off, words = max(found)
    return (words,), off > _APART


def _reach(mount: Mount, mesh: ObjectMesh | None) -> tuple[str, ...]:
    """How far off the near and the far end of the object may be: a turn has a long lever."""
    if mount.covariance is None or mesh is None:
        return ()
    R, t = mount.T_phone_object[:3, :3], mount.T_phone_object[:3, 3]
    away = np.linalg.norm(mesh.vertices @ R.T + t, axis=1)
    near, far = (_bound(mount, mesh.vertices[k]) for k in (away.argmin(), away.argmax()))
    return (
        f"Points of the object beside the phone are known to {near:.0f} mm, those of its far end, "
        f"{100 * away.max():.0f} cm away, to {far:.0f} mm: the farther, the more a small turn counts.",
    )


def _bound(mount: Mount, vertex: Float64[np.ndarray, "3"]) -> float:
    """Millimetres within which a point of the object is known 95 times of 100, seen from the phone."""
    assert mount.covariance is not None
    x, y, z = mount.T_phone_object[:3, :3] @ vertex
    turned = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    moves = np.hstack([turned, np.eye(3)])
    covariance = np.zeros((6, 6))
    covariance[3:, 3:] = moves @ mount.covariance @ moves.T
    return bounds_95(covariance).mm
