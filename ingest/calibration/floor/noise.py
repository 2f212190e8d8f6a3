"""Noise of gravity, floor and tracking, propagated to the residuals of contacts."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from ingest.calibration.floor.level import FloorLevel
from ingest.calibration.floor.standing import StandingContact

_GRAVITY = np.radians(0.4)
"""Of ARKit's gravity over a whole session, on each axis; phones differ by 0.3 to 1 deg."""
_CONTACT_TILT = np.radians(0.3)
"""From one contact to the next: gravity wanders, floors are not flat."""
_CONTACT_HEIGHT = 0.002
_MESH_HEIGHT = 0.003
"""Metres that a side of the mesh is off."""
_DRIFT = 0.004
"""Metres of height per metre that the phone has gone in the take."""


def tangent(direction: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 2"]:
    """Two unit vectors square to a unit vector and to each other."""
    return np.linalg.svd(direction[None])[2][1:].T


def contact_covariance(
    standings: Sequence[StandingContact],
    level: FloorLevel,
    T_phone_object: Float64[np.ndarray, "4 4"],
) -> Float64[np.ndarray, "n n"]:
    """Covariance of the residuals of `ingest.calibration.floor.refine`: two tilts each, then all heights.

    What several contacts share (the session's gravity, a side of the mesh, drift) makes them err
    alike, so that a hundred contacts are not ten times as sure as one.
    """
    low = [k for k, standing in enumerate(standings) if standing.on_floor]
    bases = [tangent(standing.contact.down) for standing in standings]
    gravity, own = _gravity(standings, bases, low, level, T_phone_object)
    sources = [
        _GRAVITY * gravity,
        _CONTACT_TILT * own,
        _sides(standings, bases, low, T_phone_object),
        _heights(standings, low, level),
    ]
    A = np.concatenate(sources, axis=1)
    return A @ A.T


def _gravity(
    standings: Sequence[StandingContact],
    bases: list[Float64[np.ndarray, "3 2"]],
    low: list[int],
    level: FloorLevel,
    T_phone_object: Float64[np.ndarray, "4 4"],
) -> tuple[Float64[np.ndarray, "n 2"], Float64[np.ndarray, "n own"]]:
    """What 1 rad of the session's gravity does, and what one of each contact's own does."""
    sways = [standing.contact.sway for standing in standings]
    feet = [placed(T_phone_object, standings[k]) for k in low]
    # A world that is tilted also rises from where the floor's height is known to the contact.
    rises = [standings[k].contact.place[:2] - level.place for k in low]
    tilts = [base.T @ sway for base, sway in zip(bases, sways, strict=True)]
    heights = [foot @ sways[k] + rise for foot, k, rise in zip(feet, low, rises, strict=True)]
    alone = np.zeros((len(low), 2 * len(standings)))
    for row, k in enumerate(low):
        alone[row, 2 * k : 2 * k + 2] = feet[row] @ bases[k]
    return np.vstack([*tilts, *heights]), np.vstack([np.eye(2 * len(standings)), alone])


def placed(
    T_phone_object: Float64[np.ndarray, "4 4"], standing: StandingContact
) -> Float64[np.ndarray, "3"]:
    """Where the side on the floor is in the phone's frame."""
    return T_phone_object[:3, :3] @ standing.side.centre + T_phone_object[:3, 3]


def _sides(
    standings: Sequence[StandingContact],
    bases: list[Float64[np.ndarray, "3 2"]],
    low: list[int],
    T_phone_object: Float64[np.ndarray, "4 4"],
) -> Float64[np.ndarray, "n sources"]:
    """What errors of the mesh do: each side is tilted and moved as one."""
    columns: list[np.ndarray] = []
    for side in {id(standing.side): standing.side for standing in standings}.values():
        turned = side.sd * T_phone_object[:3, :3] @ tangent(side.down)
        own = [float(standing.side is side) for standing in standings]
        tilts = [on * base.T @ turned for base, on in zip(bases, own, strict=True)]
        columns.append(np.vstack([*tilts, np.zeros((len(low), 2))]))
        moved = [_MESH_HEIGHT * own[k] for k in low]
        columns.append(np.concatenate([np.zeros(2 * len(own)), moved])[:, None])
    return np.concatenate(columns, axis=1)


def _heights(
    standings: Sequence[StandingContact], low: list[int], level: FloorLevel
) -> Float64[np.ndarray, "n sources"]:
    """What errors of heights do: each its own, all that of the floor, and drift along the path."""
    paths = np.array([standings[k].contact.path for k in low])
    stops = np.unique([*paths, level.path])
    walked = _DRIFT * np.sqrt(np.diff(stops) * stops[-1])
    first, last = np.minimum(paths, level.path), np.maximum(paths, level.path)
    between = (first[:, None] <= stops[:-1]) & (stops[1:] <= last[:, None])
    errors = [
        _CONTACT_HEIGHT * np.eye(len(low)),
        np.full((len(low), 1), level.sd),
        between * walked,
    ]
    heights = np.concatenate(errors, axis=1)
    return np.vstack([np.zeros((2 * len(standings), heights.shape[1])), heights])
