"""Whether something moved while it was filmed: matches that share another motion than the cameras'."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.report.check import Check
from ingest.scan.types import View
from ingest.uncertainty import skew
from omomo_core.geometry.transforms import inverse

_MOST_PAIRS = 200
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
        some = np.unique(np.linspace(0, len(pairs) - 1, _MOST_PAIRS).astype(int)) if pairs else []
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
