"""How long a metre is in a model by a length between two picked points, and where rays meet."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.scan.cameras.options import Length, Sight
from ingest.scan.types import Scale, View
from omomo_core.errors import InputError

_MIN_ANGLE = np.radians(2.0)
"""Between the rays of a point."""
_PICKED = 2.0
"""Standard deviation of a picked point, pixels."""


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
