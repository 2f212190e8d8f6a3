"""coverage: from which directions the pictures show the object, and from which none does."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.report.check import Check, graded
from ingest.scan.found import Found
from ingest.scan.types import Region, View
from omomo_core.geometry.transforms import inverse

AROUND = "all around"
"""The check of the circle; bad where one side of the object was filmed and the rest was not."""
_GAP_WARN, _GAP_BAD = 60.0, 150.0
"""Degrees of the circle around the object from which no picture is taken."""
_HIGH, _LOW = 25.0, 25.0
"""Degrees over the level: pictures above and below show the top and the sides."""


@dataclass(frozen=True)
class Coverage:
    """Directions from the object to the cameras whose pictures show it."""

    azimuth: Float64[np.ndarray, " views"]
    """Degrees to the right of where the film begins, as a person who faces the object walks."""
    elevation: Float64[np.ndarray, " views"]
    """Degrees over the level of the object's middle."""
    distance: Float64[np.ndarray, " views"]
    """From the object's middle, metres."""

    @property
    def gap(self) -> tuple[float, float]:
        """The widest stretch of the circle without a picture: where it begins and its width."""
        around = np.sort(self.azimuth % 360)
        if len(around) == 0:
            return 0.0, 360.0
        widths = np.diff(np.append(around, around[0] + 360))
        widest = int(widths.argmax())
        return float(around[widest]), float(widths[widest])


def coverage_of(found: Found) -> Coverage:
    """Where the pictures are taken from, seen from the middle of the object.

    Pictures of a symmetric object show it from the other side too.
    """
    T = inverse(found.cleaned.T_world_object)
    vertices = found.cleaned.mesh.vertices
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    R, t = found.cleaned.T_world_object[:3, :3], found.cleaned.T_world_object[:3, 3]
    shown = [view for view in found.registered.views if _shows(view, R @ middle + t)]
    eyes = np.array([view.T_world_camera[:3, 3] for view in shown]).reshape(-1, 3)
    if found.mirror is not None:
        floor = found.region.T_world_floor
        T_mirror = floor @ found.mirror.reflection @ inverse(floor)
        eyes = np.concatenate([eyes, eyes @ T_mirror[:3, :3].T + T_mirror[:3, 3]])
    x, y, z = (eyes @ T[:3, :3].T + T[:3, 3] - middle).T
    azimuth = np.degrees(np.arctan2(y, x))
    first = azimuth[0] if len(azimuth) else 0.0
    return Coverage(
        (azimuth - first) % 360,
        np.degrees(np.arctan2(z, np.hypot(x, y))),
        np.hypot(np.hypot(x, y), z),
    )


def _shows(view: View, point: Float64[np.ndarray, "3"]) -> bool:
    T = inverse(view.T_world_camera)
    x, y, z = T[:3, :3] @ point + T[:3, 3]
    fx, fy, cx, cy = view.intrinsics
    return bool(
        z > 0 and 0 <= fx * x / z + cx < view.size[0] and 0 <= fy * y / z + cy < view.size[1]
    )


def coverage_checks(coverage: Coverage) -> tuple[Check, ...]:
    """Whether the film goes all around, and both high and low."""
    start, width = coverage.gap
    severity = "bad" if width > _GAP_BAD else "warn" if width > _GAP_WARN else "ok"
    if severity == "ok":
        message = f"Pictures from all around; the widest gap between two is {width:.0f} degrees."
    else:
        message = f"No picture shows the object from {width:.0f} degrees of the circle around it."
    fix = (
        f"Film again from {start:.0f} to {start + width:.0f} degrees to the right of where the film "
        "begins, facing the object (90 is a quarter of the way around)."
    )
    return (graded(AROUND, severity, message, fix), _heights(coverage))


def _heights(coverage: Coverage) -> Check:
    if len(coverage.elevation) == 0:
        return Check("heights", "bad", "No picture shows the object.")
    low, high = float(coverage.elevation.min()), float(coverage.elevation.max())
    message = f"Pictures from {low:.0f} to {high:.0f} degrees over the level of its middle."
    fixes = ["Film a round from higher, looking down on it."] * (high < _HIGH)
    fixes += ["Film a round from lower, at the level of its middle."] * (low > _LOW)
    return graded("heights", "warn" if fixes else "ok", message, " ".join(fixes))


def one_sided(views: Sequence[View], region: Region) -> bool:
    """Whether a wide stretch of the circle around the region is not filmed from."""
    T = inverse(region.T_world_floor)
    middle = (region.low + region.high) / 2
    eyes = np.array([view.T_world_camera[:3, 3] for view in views])
    x, y, z = (eyes @ T[:3, :3].T + T[:3, 3] - middle).T
    around = Coverage(np.degrees(np.arctan2(y, x)), np.zeros(len(x)), np.hypot(np.hypot(x, y), z))
    return around.gap[1] > _GAP_WARN
