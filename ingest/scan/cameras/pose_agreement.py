"""Whether poses agree with the pictures, and whether something moved while it was filmed."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.report.take_report import Check
from ingest.scan.scan_types import Frame, View
from ingest.uncertainty import skew
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

AS_LOGGED = "logged"
_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
_TOLERANCE = 0.012
"""Part of the picture's width by which a match may be off: poses of a phone err by half a degree."""
_MOST_PAIRS, _MOST_MATCHES = 150, 60
_ENOUGH, _BETTER = 0.5, 1.5
"""Part of the matches that poses must explain, and how many more others must to be right instead."""


def readings(
    T: Float64[np.ndarray, "poses 4 4"],
) -> dict[str, Float64[np.ndarray, "poses 4 4"]]:
    """What poses may mean: as they are, or by the usual mistakes."""
    transposed = T.copy()
    transposed[:, :3, :3] = T[:, :3, :3].swapaxes(1, 2)
    plain = {AS_LOGGED: T, "inverted": inverse(T), "transposed": transposed}
    flipped = {f"{name}-flipped": poses @ _FLIP for name, poses in plain.items()}
    turned: dict[str, np.ndarray] = {}
    for quarter, name in ((1, "left"), (2, "over"), (3, "right")):
        c, s = np.cos(np.pi / 2 * quarter), np.sin(np.pi / 2 * quarter)
        R = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        turned[f"turned-{name}"] = T @ R
    return plain | flipped | turned


def as_read(T: Float64[np.ndarray, "poses 4 4"], axes: str) -> Float64[np.ndarray, "poses 4 4"]:
    """The poses under the reading that somebody names.

    Raises:
        InputError: "scan-axes-unknown".
    """
    known = readings(T)
    if axes not in known:
        raise InputError(
            "scan-axes-unknown",
            f"Camera axes are not called {axes!r}.",
            field="camera_axes",
            fix=f"Give one of {', '.join(known)}.",
        )
    return known[axes]


@dataclass(frozen=True)
class _Pair:
    """Matches of two pictures as rays (x, y, 1) in their cameras."""

    a: int
    b: int
    rays_a: Float64[np.ndarray, "matches 3"]
    rays_b: Float64[np.ndarray, "matches 3"]


def check_axes(
    database: Path,
    frames: Sequence[Frame],
    T_world_camera: Float64[np.ndarray, "pictures 4 4"],
    where: str,
) -> float:
    """How many of the matches can be triangulated with these poses, 0 to 1.

    Raises:
        InputError: "scan-axes" when another reading of the poses explains the pictures much
            better; "scan-poses" when none does.
    """
    pairs = _pairs(database, frames)
    if not pairs:
        return 0.0
    shares = {name: _share(pairs, T) for name, T in readings(T_world_camera).items()}
    logged, best = shares[AS_LOGGED], max(shares, key=lambda name: shares[name])
    if best != AS_LOGGED and shares[best] > max(_ENOUGH, _BETTER * logged):
        raise InputError(
            "scan-axes",
            f"With the poses as they are logged {logged:.0%} of the matches between pictures can be "
            f"triangulated; read as '{best}' it is {shares[best]:.0%}: that is what they are.",
            where=where,
            fix=f"Say so with ‹camera_axes› {best}, and give the scan's other poses the same way.",
        )
    if logged < _ENOUGH / 2:
        raise InputError(
            "scan-poses",
            f"The poses of the log do not belong to its pictures: {logged:.0%} of the matches can be "
            "triangulated with them, and not many more however they are read.",
            where=where,
            fix="Leave the poses out (‹no poses›) and give a length for the scale; or film again, "
            "without covering the camera.",
        )
    return logged


def _share(pairs: Sequence[_Pair], T: Float64[np.ndarray, "pictures 4 4"]) -> float:
    """Part of the matches whose rays meet in front of both cameras, as well as poses allow."""
    met, count = 0, 0
    for pair in pairs:
        T_a_b = inverse(T[pair.a]) @ T[pair.b]
        baseline = T_a_b[:3, 3]
        if np.linalg.norm(baseline) < 1e-6:
            continue
        met += int(_meet(pair.rays_a, pair.rays_b @ T_a_b[:3, :3].T, baseline).sum())
        count += len(pair.rays_a)
    return met / max(count, 1)


def _meet(
    a: Float64[np.ndarray, "rays 3"], b: Float64[np.ndarray, "rays 3"], baseline: np.ndarray
) -> np.ndarray:
    """Whether rays from the origin and from the baseline's end pass each other closely, ahead."""
    a = a / np.linalg.norm(a, axis=1, keepdims=True)
    b = b / np.linalg.norm(b, axis=1, keepdims=True)
    cosine = (a * b).sum(axis=1)
    along_a, along_b = a @ baseline, b @ baseline
    sine = np.maximum(1 - cosine**2, 1e-9)
    depth_a = (along_a - cosine * along_b) / sine
    depth_b = (cosine * along_a - along_b) / sine
    gap = np.linalg.norm(depth_a[:, None] * a - depth_b[:, None] * b - baseline, axis=1)
    near = np.minimum(depth_a, depth_b)
    return (near > 0) & (gap < 2 * _TOLERANCE * near)


def _pairs(database: Path, frames: Sequence[Frame]) -> list[_Pair]:
    """Verified matches of some pairs, as rays."""
    place = {frame.name: k for k, frame in enumerate(frames)}
    with pycolmap.Database.open(database) as opened:
        of_number = {i.image_id: place[i.name] for i in opened.read_all_images() if i.name in place}
        ids, geometries = opened.read_two_view_geometries()
        good = [k for k, g in enumerate(geometries) if len(g.inlier_matches) >= 20]
        some = np.unique(np.linspace(0, len(good) - 1, _MOST_PAIRS).astype(int)) if good else []
        pairs: list[_Pair] = []
        for k in (good[int(i)] for i in some):
            numbers = pycolmap.pair_id_to_image_pair(ids[k])
            if not set(numbers) <= set(of_number):
                continue
            matches = np.asarray(geometries[k].inlier_matches, np.int64)[:_MOST_MATCHES]
            a, b = (of_number[number] for number in numbers)
            rays = [
                _rays(opened.read_keypoints(number)[matches[:, side], :2], frames[view])
                for side, (number, view) in enumerate(zip(numbers, (a, b), strict=True))
            ]
            pairs.append(_Pair(a, b, *rays))
    return pairs


def _rays(pixels: np.ndarray, frame: Frame) -> Float64[np.ndarray, "matches 3"]:
    assert frame.intrinsics is not None
    fx, fy, cx, cy = frame.intrinsics
    flat = (pixels.astype(np.float64) - 0.5 - [cx, cy]) / [fx, fy]
    return np.concatenate([flat, np.ones((len(flat), 1))], axis=1)


_MOST_MOTION_PAIRS = 200
_OFF = 6.0
"""Pixels of a picture 960 wide off the line on which a match must lie."""
_FEWEST, _SHARE = 20, 0.6
"""Matches off their lines that agree with each other, and their part of all that are off."""
_PAIRS = 0.06
"""Part of the pairs with a second motion above which something moved."""


def moving(database: Path, views: Sequence[View]) -> tuple[Check, ...]:
    """A warning where many pairs of pictures show a second rigid motion."""
    seen, second = 0, 0
    with pycolmap.Database.open(database) as opened:
        by_name = {view.name: view for view in views}
        known = {i.image_id: by_name.get(i.name) for i in opened.read_all_images()}
        ids, _ = opened.read_two_view_geometries()
        pairs = [pycolmap.pair_id_to_image_pair(one) for one in ids]
        some = (
            np.unique(np.linspace(0, len(pairs) - 1, _MOST_MOTION_PAIRS).astype(int))
            if pairs
            else []
        )
        for a, b in (pairs[int(k)] for k in some):
            view_a, view_b = known.get(a), known.get(b)
            if view_a is None or view_b is None:
                continue
            matches = np.asarray(opened.read_matches(a, b), np.int64)
            if len(matches) < 2 * _FEWEST:
                continue
            pixels_a = opened.read_keypoints(a)[matches[:, 0], :2] - 0.5
            pixels_b = opened.read_keypoints(b)[matches[:, 1], :2] - 0.5
            seen += 1
            second += _has_second(view_a, view_b, pixels_a, pixels_b)
    if seen == 0 or second < _PAIRS * seen:
        return ()
    message = (
        f"In {second} of {seen} pairs of pictures a part of what they show has moved otherwise than "
        "the rest: the object was moved, or something else was."
    )
    fix = "Film again, with nothing touched until the walk around it is over."
    return (Check("stillness", "warn", message, None, fix),)


def _has_second(a: View, b: View, pixels_a: np.ndarray, pixels_b: np.ndarray) -> bool:
    off = off_line(a, b, pixels_a, pixels_b) > _OFF * max(a.size) / 960
    if off.sum() < _FEWEST:
        return False
    agree = in_one_motion(pixels_a[off], pixels_b[off])
    return agree >= max(_FEWEST, _SHARE * int(off.sum()))


def in_one_motion(pixels_a: np.ndarray, pixels_b: np.ndarray) -> int:
    """Return how many matches agree on one rigid motion, 0 where none is found.

    On some matches OpenCV's search ends with an empty model and fails an assertion of its own.
    """
    a, b = pixels_a.astype(np.float32), pixels_b.astype(np.float32)
    try:
        found: Any = cv2.findFundamentalMat(a, b, cv2.USAC_MAGSAC, 1.5)[1]
    except cv2.error:
        return 0
    return 0 if found is None else int(np.asarray(found).sum())


def off_line(
    a: View, b: View, pixels_a: np.ndarray, pixels_b: np.ndarray
) -> Float64[np.ndarray, " matches"]:
    """Pixels between points in b and the epipolar lines of the same in a."""
    T_b_a = inverse(b.T_world_camera) @ a.T_world_camera
    E = skew(T_b_a[None, :3, 3])[0] @ T_b_a[:3, :3]
    line = _homogeneous(a, pixels_a) @ E.T
    rays = _homogeneous(b, pixels_b)
    size = np.maximum(np.linalg.norm(line[:, :2], axis=1), 1e-12)
    return np.abs((line * rays).sum(axis=1)) / size * b.intrinsics[0]


def _homogeneous(view: View, pixels: np.ndarray) -> Float64[np.ndarray, "points 3"]:
    flat = (pixels.astype(np.float64) - view.intrinsics[2:]) / view.intrinsics[:2]
    return np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
