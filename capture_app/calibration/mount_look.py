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
    good, apart = f"{len(pairs)} points", worst_distance(pairs, phone)
    if len(pairs) < ENOUGH:
        told = () if apart is None else (apart.words,)
        doubts = told if apart is not None and apart.off > _APART else ()
        return MountLook(Finding(good, _astray(pairs, mesh) + doubts, told[len(doubts) :]), None)
    try:
        return fit_of_points(pairs, phone, mesh)
    except InputError as error:
        told = () if apart is None else (apart.words,)
        return MountLook(Finding(good, (*_astray(pairs, mesh), *told, error.what)), None)


def fit_of_points(pairs: Sequence[PointPair], phone: Phone, mesh: ObjectMesh | None) -> MountLook:
    """Return the mount that points give, and how they fit; the arguments are those of `look_at_points`.

    Raises:
        InputError: as `mount_from_pairs`.
    """
    fit, mount = (picked := mount_from_pairs(pairs, phone)).fit, picked.mount
    worst = int(fit.residuals.argmax())
    rms, most = 1e3 * fit.rms, 1e3 * float(fit.residuals[worst])
    doubts, notes = _astray(pairs, mesh), _reach(mount, mesh)
    if fit.loose or not fit.kept.all() or fit.residuals[worst] > _MISFIT:
        apart = worst_distance(pairs, phone)
        doubts += (
            f"The points fit the phone to {most:.0f} mm only; clicked with care they fit to 5 mm. Look at "
            f"'{pairs[worst].name}' first: is it the right corner, and is the object's size right?",
            *([apart.words] if apart is not None and apart.off > _APART else []),
        )
    if len(pairs) == ENOUGH:
        notes += ("Three points fit nearly always: a fourth would show a mistake.",)
    if mount.note:
        notes += (mount.note,)
    good = f"{len(pairs)} points, which fit the phone within {rms:.1f} mm (worst {most:.1f})"
    return MountLook(Finding(good, doubts, notes), mount)


def _astray(pairs: Sequence[PointPair], mesh: ObjectMesh | None) -> tuple[str, ...]:
    """A doubt about the point that is farthest from the object, if that is far."""
    if mesh is None:
        return ()
    places = np.array([pair.object for pair in pairs])
    return astray(mesh, [pair.name for pair in pairs], places, HELD_OFF)


class Distance(NamedTuple):
    """How far apart two points are on the object and on the phone."""

    off: float
    """Difference of the two, metres."""
    words: str


def worst_distance(pairs: Sequence[PointPair], phone: Phone) -> Distance | None:
    """Return the two named points whose distance differs most from that on the phone; None of fewer."""
    found: list[Distance] = []
    for a, b in combinations([pair for pair in pairs if isinstance(pair.phone, str)], 2):
        here = float(np.linalg.norm(np.subtract(a.object, b.object)))
        there = float(np.linalg.norm(body_point(phone, a.name) - body_point(phone, b.name)))
        words = (
            f"'{a.name}' and '{b.name}' are {100 * here:.1f} cm apart here, {100 * there:.1f} cm on "
            f"the {phone.name}."
        )
        found.append(Distance(abs(here - there), words))
    return max(found, default=None)


def _reach(mount: Mount, mesh: ObjectMesh | None) -> tuple[str, ...]:
    """A sentence on how far off both ends of the object may be: errors of direction grow with distance."""
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
