"""The object's region: the floor it stands on, and the box around it, from where the cameras look."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int64

from ingest.report.take_report import Check, graded
from ingest.scan.cameras.pose_agreement import AS_LOGGED, readings
from ingest.scan.scan_types import Frame, Region, Registered, View
from ingest.trajectory.plane import Plane, fit_plane
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_AIM_ROUNDS = 20
_NARROWEST = np.radians(8)
"""Between the widest pair of directions to a camera: a smaller turn says nothing about depth."""
_MISSES = 0.4
"""Distance by which optical axes may miss the aim, in parts of the way to it (median)."""
_FEWEST = 3


@dataclass(frozen=True)
class Aim:
    """The place at which optical axes meet."""

    point: Float64[np.ndarray, "3"]
    """World, metres."""
    distance: float
    """Median way from the cameras, metres."""
    miss: float
    """Median way by which the axes miss the point, in parts of `distance`."""


def find_aim(views: Sequence[View]) -> Aim:
    """The point nearest to the optical axes, those that look elsewhere counting little.

    Raises:
        InputError: "scan-no-aim" where the axes do not meet, or "scan-no-orbit" where the cameras
            all stand on one side.
    """
    if len(views) < _FEWEST:
        raise _no_aim(f"there are only {len(views)} pictures")
    poses = np.stack([view.T_world_camera for view in views])
    eyes, axes = poses[:, :3, 3], poses[:, :3, 2]
    # One direction gives no depth: its equations would be singular.
    if np.arccos(np.clip(axes @ axes.T, -1, 1)).max() < _NARROWEST:
        raise _no_orbit()
    weights = np.ones(len(eyes))
    point = eyes.mean(axis=0)
    for _ in range(_AIM_ROUNDS):
        point = _nearest(eyes, axes, weights)
        misses = _misses(eyes, axes, point)
        weights = 1 / (1 + (misses / max(float(np.median(misses)), 1e-6)) ** 2)
    to_point = point - eyes
    far = np.linalg.norm(to_point, axis=1)
    miss = float(np.median(_misses(eyes, axes, point) / far))
    ahead = np.einsum("ij,ij->i", to_point, axes) > 0
    if miss > _MISSES or ahead.mean() < 1 - _MISSES:
        raise _no_aim(f"their axes miss each other by {miss:.0%} of the way")
    seen_from = to_point / far[:, None]
    if np.arccos(np.clip(seen_from @ seen_from.T, -1, 1)).max() < _NARROWEST:
        raise _no_orbit()
    return Aim(point, float(np.median(far)), miss)


def _nearest(
    eyes: Float64[np.ndarray, "views 3"],
    axes: Float64[np.ndarray, "views 3"],
    weights: Float64[np.ndarray, " views"],
) -> Float64[np.ndarray, "3"]:
    """The point with the least squared distance to lines."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    A = np.einsum("v,vij->ij", weights, across)
    return np.linalg.solve(A, np.einsum("v,vij,vj->i", weights, across, eyes))


def _misses(
    eyes: Float64[np.ndarray, "views 3"],
    axes: Float64[np.ndarray, "views 3"],
    point: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, " views"]:
    """Metres from a point to lines."""
    return np.linalg.norm(np.cross(point - eyes, axes), axis=1)


def _no_aim(why: str) -> InputError:
    return InputError(
        "scan-no-aim",
        f"The object was not found: the cameras do not look at one place ({why}).",
        fix="Walk around the object with it in the middle of the picture, or give the box that it "
        "is in.",
    )


def _no_orbit() -> InputError:
    return InputError(
        "scan-no-orbit",
        "The object was not found: all the pictures are taken from one direction.",
        fix="Walk all around the object while you film it.",
    )


_NEAR = 0.7
"""Part of the way from the cameras to the aim: points farther from it are of other things."""
_TILT = np.radians(6)
"""Between gravity and the normal of a floor."""
_GUESSED_TILT = np.radians(30)
"""The same where up is only a guess."""
_WIDE = 0.35
"""Part of the way from the cameras: a floor has points farther from the aim, in most directions."""
_SECTORS = 8
_TRIALS = 4
"""Planes that are looked at."""
_THICK = 0.02
_ABOVE_AIM = 0.05
_THINNEST = 0.002
"""Metres; no sparse points lie better in a plane than that."""
_FLOOR_ROUNDS = 6
_LOWEST = 2.0
"""Percentile of the heights that stands in for a floor that has no detail."""


@dataclass(frozen=True)
class ScanFloor:
    """The floor under the aim."""

    T_world_floor: Float64[np.ndarray, "4 4"]
    """z is its normal; the origin is below the aim."""
    noise: float
    """How far its points lie from it, metres (robust standard deviation)."""
    note: Check


def find_floor(registered: Registered, aim: Aim) -> ScanFloor:
    """The largest level plane near the aim and below it, or the lowest points where there is none."""
    away = np.linalg.norm((registered.points - aim.point)[:, :2], axis=1)
    below = registered.points[:, 2] < aim.point[2] + _ABOVE_AIM
    near = registered.points[(away < _NEAR * aim.distance) & below]
    guessed = registered.up in ("cameras", "floor")
    plane = _widest(near, aim, _GUESSED_TILT if guessed else _TILT)
    if plane is None:
        return _lowest(near if len(near) else registered.points, aim)
    normal, height, noise = _tightened(near, plane.normal, plane.offset)
    message = f"The floor lies within {1e3 * noise:.0f} mm of its points."
    return ScanFloor(floor_frame(normal, height, aim.point), noise, Check("floor", "ok", message))


def _widest(points: Float64[np.ndarray, "points 3"], aim: Aim, max_tilt: float) -> Plane | None:
    """The largest level plane that goes on around the aim, as a floor does and no seat of a chair."""
    for _ in range(_TRIALS):
        plane = fit_plane(points, np.array([0.0, 0.0, 1.0]), max_tilt)
        if plane is None:
            break
        on = np.abs(points @ plane.normal - plane.offset) < _THICK
        x, y = (points[on] - aim.point)[:, :2].T
        far = np.hypot(x, y) > _WIDE * aim.distance
        sectors = np.floor(np.arctan2(y[far], x[far]) / (2 * np.pi) * _SECTORS)
        if len(np.unique(sectors)) > _SECTORS / 2:
            return plane
        points = points[~on]
    return None


def _lowest(points: Float64[np.ndarray, "points 3"], aim: Aim) -> ScanFloor:
    height = float(np.percentile(points[:, 2], _LOWEST)) if len(points) else 0.0
    note = Check(
        "floor",
        "warn",
        "No floor was found, so the lowest points stand in for it.",
        fix="Film the floor around the object too; lay something with a pattern on a plain one.",
    )
    return ScanFloor(floor_frame(np.array([0.0, 0.0, 1.0]), height, aim.point), 0.01, note)


def _tightened(
    points: Float64[np.ndarray, "points 3"], normal: Float64[np.ndarray, "3"], offset: float
) -> tuple[Float64[np.ndarray, "3"], float, float]:
    """The plane fitted to the points that lie in it as closely as most do: also their noise."""
    noise = _THINNEST
    for _ in range(_FLOOR_ROUNDS):
        beyond = points @ normal - offset
        close = beyond[np.abs(beyond) < _THICK]
        noise = max(1.4826 * float(np.median(np.abs(close))), _THINNEST)
        on = points[np.abs(beyond) < 2.5 * noise]
        centre = on.mean(axis=0)
        # A plane has one direction with no spread; its sign is the old one's.
        fitted = np.linalg.eigh((on - centre).T @ (on - centre))[1][:, 0]
        normal = fitted * np.sign(fitted @ normal)
        offset = float(normal @ centre)
    return normal, offset, noise


def floor_frame(
    normal: Float64[np.ndarray, "3"], offset: float, point: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "4 4"]:
    """T_world_floor with x as near to the world's as can be."""
    x = np.array([1.0, 0.0, 0.0])
    x = x - (x @ normal) * normal
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    # Below the point along the world's up, which a tilted normal is not.
    T[:3, 3] = point + np.array([0.0, 0.0, (offset - normal @ point) / normal[2]])
    return T


_MOST_LOST = 0.2
"""Part of the pictures without a pose beyond which the poses tell nothing."""


def check_logged_aim(frames: Sequence[Frame]) -> None:
    """Check that the cameras look at one place under some reading of their poses.

    Which reading is right is only known once pictures are matched.

    Raises:
        InputError: those of `find_aim`, for the poses as they were logged.
    """
    posed = [(frame, frame.T_world_camera) for frame in frames]
    known = [(frame, T) for frame, T in posed if T is not None and np.isfinite(T).all()]
    if len(known) < (1 - _MOST_LOST) * len(frames) or not known:
        return
    means = readings(np.array([T for _, T in known]))
    failed = {name: _failure([frame for frame, _ in known], T) for name, T in means.items()}
    logged = failed[AS_LOGGED]
    if logged is not None and all(failure is not None for failure in failed.values()):
        raise logged


def _failure(
    frames: Sequence[Frame], T_world_camera: Float64[np.ndarray, "pictures 4 4"]
) -> InputError | None:
    """Why poses have no aim; None where they have one."""
    views = [
        View(frame.name, frame.file, frame.size, np.ones(4), T)
        for frame, T in zip(frames, T_world_camera, strict=True)
    ]
    try:
        find_aim(views)
    except InputError as error:
        return error
    return None


_CELL = 0.04
"""Metres; things in plan nearer to each other than about two of these are one."""
_SPREAD = 0.25
"""Part of the way to the cameras within which a part still counts as what is aimed at."""
_RIM = 0.2
"""Percent of the points of each end that may be mistakes."""
FEWEST = 20
"""Points: fewer may be anything."""


@dataclass(frozen=True)
class StandingStructure:
    """Box of the structure that stands on the floor at the aim; floor's frame, metres."""

    low: Float64[np.ndarray, "3"]
    high: Float64[np.ndarray, "3"]
    points: int
    beside: float
    """Weight of the second best structure over that of this one; near 1 the choice is ambiguous."""


def standing_at(
    points: Float64[np.ndarray, "points 3"], distance: float
) -> StandingStructure | None:
    """The structure nearest to the floor frame's z axis.

    Parts are joined in plan, not in space: a pole without detail still joins a lamp's shade with its
    foot, and everything stands on the floor.

    Args:
        points: above the floor, in its frame, none farther away than what may be the object.
        distance: median way from the cameras to the aim, metres.

    Returns:
        None when there are too few points.
    """
    if len(points) < FEWEST:
        return None
    parts = _parts(points[:, :2])
    near = np.exp(-((np.linalg.norm(points[:, :2], axis=1) / (_SPREAD * distance)) ** 2))
    weight = np.bincount(parts, weights=near)
    weight[0] = 0.0
    order = np.argsort(-weight)
    mine = points[parts == order[0]]
    if len(mine) < FEWEST:
        return None
    low, high = np.percentile(mine, (_RIM, 100 - _RIM), axis=0)
    other = weight[order[1]] if len(order) > 1 else 0.0
    return StandingStructure(low, high, len(mine), float(other / weight[order[0]]))


def _parts(plan: Float64[np.ndarray, "points 2"]) -> Int64[np.ndarray, " points"]:
    """Number of the connected part that each point belongs to; 0 is a stray one."""
    cells = np.floor(plan / _CELL).astype(int)
    cells -= cells.min(axis=0)
    count = np.zeros(cells.max(axis=0) + 3, int)
    at = (cells[:, 0] + 1, cells[:, 1] + 1)
    np.add.at(count, at, 1)
    # A cell with one point counts where its neighbours have some too.
    crowd = _around(count)
    filled = (count > 1) | ((count > 0) & (crowd > 1))
    # Grown by a cell all around, parts reach each other over a gap of one.
    _, numbers = cv2.connectedComponents((_around(filled.astype(int)) > 0).astype(np.uint8))
    return np.where(filled[at], np.asarray(numbers)[at], 0).astype(np.int64)


def _around(count: Int64[np.ndarray, "x y"]) -> Int64[np.ndarray, "x y"]:
    """Sum of each cell and its eight neighbours."""
    total = np.zeros_like(count)
    padded = np.pad(count, 1)
    for dx in range(3):
        for dy in range(3):
            total += padded[dx : dx + count.shape[0], dy : dy + count.shape[1]]
    return total


def amid(
    points: Float64[np.ndarray, "points 3"], eyes: Float64[np.ndarray, "views 3"], inside: float
) -> Bool[np.ndarray, " points"]:
    """Which points lie between the aim and the cameras: `inside` is the part of the way there.

    Args:
        points, eyes: in the floor's frame, metres.
        inside: 0 to 1.
    """
    ring = np.linalg.norm(eyes[:, :2], axis=1)
    # A camera right above the aim stands in no ring.
    reach = inside * float(np.percentile(ring, 25))
    return np.linalg.norm(points[:, :2], axis=1) < reach


_CLEAR = 0.015
"""Metres above the floor where the object's points begin, at least."""
_CLEAR_DENSE = 0.06
"""The same for depth maps, which show the floor itself a few centimetres off."""
_INSIDE = 0.85
"""Part of the way from the aim to the cameras: what is farther out is not what they go around."""
_WATCHED = 0.35
"""Part of the pictures that must show a place: the object is in most of them, a wall in few."""
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
    """Return the place at which the cameras look; the middle of a given box where it is not one place.

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
