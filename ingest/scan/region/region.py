"""find_region: the floor and the box of a scan's object, found or given."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.report.check import Check, graded
from ingest.scan.region.aim import Aim, find_aim
from ingest.scan.region.floor import ScanFloor, find_floor
from ingest.scan.region.structure import StandingStructure, amid, standing_at
from ingest.scan.types import Region, Registered, View
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_CLEAR = 0.015
"""Metres above the floor where the object's points begin, at least."""
_CLEAR_DENSE = 0.06
"""The same for depth maps, which show the floor itself a few centimetres off."""
_INSIDE = 0.85
"""Of the way from the aim to the cameras: what is farther out is not what they go around."""
_WATCHED = 0.35
"""Of the pictures that must show a place: the object is in most of them, a wall in few."""
_MARGIN, _MARGIN_SHARE = 0.03, 0.06
"""Metres, and parts of the size, around the points that were found."""
_SMALLEST, _LARGEST = 0.02, 5.0
"""Metres; sides of a box that can be given."""


@dataclass(frozen=True)
class GivenBox:
    """The box that somebody says the object is in, in the world."""

    low: Float64[np.ndarray, "3"]
    high: Float64[np.ndarray, "3"]


def aim_at(views: Sequence[View], box: GivenBox | None) -> Aim:
    """Where the cameras look; the middle of a given box where they do not look at one place.

    Raises:
        InputError: those of `find_aim`.
    """
    try:
        return find_aim(views)
    except InputError:
        if box is None:
            raise
        return _aim_of(box)


def find_region(
    registered: Registered,
    box: GivenBox | None = None,
    dense: Float64[np.ndarray, "places 3"] | None = None,
) -> Region:
    """Find the floor and the box of the object.

    Args:
        registered: cameras and sparse points.
        box: takes the place of what would be found; the floor is found all the same.
        dense: places (world, metres) where depth maps show a surface, of `cloud`; they show poles
            and bars that have no corners.

    Raises:
        InputError: "scan-no-aim", "scan-no-orbit", "scan-no-object" (nothing stands where the
            cameras look), or "scan-box" for a box that is none.
    """
    aim = _aim_of(box) if box else find_aim(registered.views)
    floor = find_floor(registered, aim)
    if box:
        return _given(box, floor)
    standing = _standing(registered, aim, floor, dense)
    margin = _MARGIN + _MARGIN_SHARE * (standing.high - standing.low)
    low, high = standing.low - margin, standing.high + margin
    low[2] = 0.0
    notes = (floor.note, _certainty(aim, standing))
    return Region(floor.T_world_floor, low, high, notes)


def _aim_of(box: GivenBox) -> Aim:
    """The middle of a given box, as if it had been looked at from a few sizes away."""
    size = box.high - box.low
    if not (np.isfinite(size).all() and (size > _SMALLEST).all() and (size < _LARGEST).all()):
        sides = " x ".join(f"{side:.3g}" for side in size)
        raise InputError(
            "scan-box",
            f"The box has sides of {sides} m; an object's lie between {_SMALLEST} and {_LARGEST} m.",
            fix="Give its lowest and its highest corner in metres, z up.",
        )
    return Aim((box.low + box.high) / 2, 2 * float(size.max()), 0.0)


def _given(box: GivenBox, floor: ScanFloor) -> Region:
    """The box in the floor's frame, standing on the floor."""
    pick = np.indices((2, 2, 2)).reshape(3, -1).T
    corners = np.where(pick, box.high, box.low)
    T = inverse(floor.T_world_floor)
    corners = corners @ T[:3, :3].T + T[:3, 3]
    low, high = corners.min(axis=0), corners.max(axis=0)
    low[2] = 0.0
    if high[2] < _SMALLEST:
        raise InputError(
            "scan-box",
            "The box lies below the floor.",
            fix="Give its lowest and its highest corner in metres, z up, as in the scan's report.",
        )
    note = Check("region", "ok", "The object is looked for in the box that was given.")
    return Region(floor.T_world_floor, low, high, (floor.note, note))


def _standing(
    registered: Registered,
    aim: Aim,
    floor: ScanFloor,
    dense: Float64[np.ndarray, "places 3"] | None,
) -> StandingStructure:
    kept = _candidates(registered.points, registered, floor, max(_CLEAR, 4 * floor.noise))
    if dense is not None:
        kept = np.concatenate([kept, _candidates(dense, registered, floor, _CLEAR_DENSE)])
    standing = standing_at(kept, aim.distance)
    if standing is None:
        raise InputError(
            "scan-no-object",
            "The object was not found: nothing with detail stands on the floor where the cameras "
            f"look ({len(kept)} points).",
            fix="Stick some tape or paper with a pattern on a plain object and film it closer, or "
            "give the box that it is in.",
        )
    return standing


def _candidates(
    points: Float64[np.ndarray, "points 3"],
    registered: Registered,
    floor: ScanFloor,
    clear: float,
) -> Float64[np.ndarray, "candidates 3"]:
    """Points in the floor's frame that are well above it, amid the cameras, and in their sight."""
    T = inverse(floor.T_world_floor)
    standing = points @ T[:3, :3].T + T[:3, 3]
    eyes = np.stack([view.T_world_camera[:3, 3] for view in registered.views])
    kept = (standing[:, 2] > clear) & amid(standing, eyes @ T[:3, :3].T + T[:3, 3], _INSIDE)
    kept[kept] = _watched(points[kept], registered.views)
    return standing[kept]


def _watched(
    points: Float64[np.ndarray, "points 3"], views: tuple[View, ...]
) -> Bool[np.ndarray, " points"]:
    """Which places are within enough of the pictures."""
    count = np.zeros(len(points), int)
    for view in views:
        T, (fx, fy, cx, cy) = inverse(view.T_world_camera), view.intrinsics
        x, y, z = (points @ T[:3, :3].T + T[:3, 3]).T
        z = np.where(z > 0, z, np.nan)
        u, v = fx * x / z + cx, fy * y / z + cy
        count += (u > -0.5) & (v > -0.5) & (u < view.size[0] - 0.5) & (v < view.size[1] - 0.5)
    return count >= _WATCHED * len(views)


def _certainty(aim: Aim, standing: StandingStructure) -> Check:
    """How sure it is that this is the object."""
    size = " x ".join(f"{side:.2f}" for side in (standing.high - standing.low)[:2])
    description = (
        f"What stands where the cameras look is about {size} m wide and {standing.high[2]:.2f} m "
        f"high ({standing.points} points; the optical axes miss it by {aim.miss:.0%} of the way)."
    )
    fix = "Look at the picture of the box; give another if it is not around the object."
    return graded("region", "warn" if standing.beside > 0.5 else "ok", description, fix)
