"""How long a metre is in a model: by a board that its pictures show, or by a length between two points."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.detect import Detector
from ingest.calibration.board.spec import Board
from ingest.scan.cameras.metric import Similarity
from ingest.scan.cameras.options import Length, Sight
from ingest.scan.types import Scale, View
from omomo_core.errors import InputError
from omomo_core.geometry.procrustes import procrustes

_CORNERS = 6
"""Of the board that must be found, each in two pictures at least."""
_MIN_ANGLE = np.radians(2.0)
"""Between the rays of a point."""
_OFF = 0.01
"""Part of the board's diagonal that its corners may be off."""
_PRINTED, _PICKED = 0.001, 2.0
"""Standard deviation of a print's size, as a part; and of a picked point, pixels."""


def by_board(
    views: Sequence[View], board: Board, on_progress: Callable[[float], None]
) -> tuple[Similarity, Scale]:
    """The similarity that takes the model to metres in the board's frame, turned z up.

    Raises:
        InputError: "scan-board-missing" when it is not seen well enough, "scan-board-moved" when it
            does not keep its shape.
    """
    detector = Detector(board)
    sights = defaultdict[int, list[tuple[View, np.ndarray]]](list)
    for k, view in enumerate(views):
        grey = cv2.imread(str(view.file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is not None:
            found = detector.find(np.asarray(grey, np.uint8))
            for number, pixel in zip(found.numbers.tolist(), found.pixels, strict=True):
                sights[number].append((view, pixel))
        on_progress((k + 1) / len(views))
    places = {number: crossing(seen) for number, seen in sights.items() if len(seen) > 1}
    known = {number: place for number, place in places.items() if place is not None}
    if len(known) < _CORNERS:
        raise InputError(
            "scan-board-missing",
            f"The board {board} gives no scale: {len(known)} of its {len(board.corners)} corners are "
            "seen from two sides.",
            where=str(views[0].file.parent),
            fix="Lay the printed board flat beside the object, in view for half of the walk; check "
            "that it is this board (--board), or give a length instead (--height).",
        )
    numbers = sorted(known)
    corners, points = board.corners[numbers], np.array([known[n] for n in numbers])
    fit = procrustes(corners, points, np.ones(len(numbers)), scaled=True)
    rms = float(np.sqrt((fit.residuals**2).sum(axis=1).mean()))
    span = float(np.linalg.norm(np.ptp(corners, axis=0)))
    if rms > _OFF * span:
        raise InputError(
            "scan-board-moved",
            f"The board's corners are {1e3 * rms:.1f} mm off their places on it.",
            where=str(views[0].file.parent),
            fix="It must lie still and flat while you film; check its squares with a ruler (--board).",
        )
    # z goes into the paper: half a turn about x makes it come out.
    out = np.diag([1.0, -1.0, -1.0])
    sigma = float(np.hypot(2 * rms / span / np.sqrt(len(numbers)), _PRINTED))
    description = f"the board {board} ({len(numbers)} corners, {1e3 * rms:.1f} mm off)"
    return Similarity(fit.scale, out @ fit.R, out @ fit.t, sigma), Scale(
        sigma, "board", description
    )


def by_length(views: Sequence[View], length: Length) -> tuple[float, Scale]:
    """Metres per unit of the model, from a length between two picked points.

    Raises:
        InputError: "scan-length-picture" for a picture that is not there, "scan-length" when the
            points cannot be placed.
    """
    by_name = {view.name: view for view in views} | {Path(v.name).stem: v for v in views}
    ends: list[np.ndarray] = []
    for name, sights in (("first", length.a), ("second", length.b)):
        end = crossing([_sight(sight, by_name) for sight in sights])
        if end is None:
            raise InputError(
                "scan-length",
                f"The {name} point of the length cannot be placed: its pictures were taken from "
                "nearly one place, or there is only one.",
                where="--length",
                fix="Pick each point in two or three pictures taken from different sides.",
            )
        ends.append(end)
    units = float(np.linalg.norm(ends[1] - ends[0]))
    away = [np.linalg.norm(view.T_world_camera[:3, 3] - ends[0]) for view in views]
    off = _PICKED / float(np.median([view.intrinsics[0] for view in views])) * np.median(away)
    sigma = float(off / max(units, 1e-9))
    scale = Scale(sigma, "length", f"a length of {length.metres:g} m between two picked points")
    return length.metres / units, scale


def _sight(sight: Sight, by_name: Mapping[str, View]) -> tuple[View, np.ndarray]:
    if sight.picture not in by_name:
        raise InputError(
            "scan-length-picture",
            f"No registered picture is called {sight.picture!r}.",
            where="--length",
            fix="Pick the points in pictures of the work folder that are registered.",
        )
    return by_name[sight.picture], np.array([sight.x, sight.y])


def crossing(
    sights: Sequence[tuple[View, Float64[np.ndarray, "2"]]],
) -> Float64[np.ndarray, "3"] | None:
    """Where the rays of a point meet; None when they are nearly parallel, or do not meet ahead."""
    if len(sights) < 2:
        return None
    eyes = np.array([view.T_world_camera[:3, 3] for view, _ in sights])
    rays = np.array([_ray(view, pixel) for view, pixel in sights])
    cosine = (rays @ rays.T).min()
    if np.arccos(np.clip(cosine, -1, 1)) < _MIN_ANGLE:
        return None
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    point = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, eyes))
    ahead = ((point - eyes) * rays).sum(axis=1) > 0
    return point if ahead.all() else None


def _ray(view: View, pixel: Float64[np.ndarray, "2"]) -> Float64[np.ndarray, "3"]:
    fx, fy, cx, cy = view.intrinsics
    ray = view.T_world_camera[:3, :3] @ [(pixel[0] - cx) / fx, (pixel[1] - cy) / fy, 1.0]
    return ray / np.linalg.norm(ray)
