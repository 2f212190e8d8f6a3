"""Mounts from the numbers of a form, as `omocap calibrate drawing` and `points` find them."""

from pathlib import Path
from typing import Any

from capture_app.calibration.calibrate import by_drawing, by_points, pairs_of, write_mount
from capture_app.commands.calibrate import DrawingWay, PointsWay
from ingest.mount import identity_mount
from ingest.mount_file import save_mount


def identity(target: Path) -> dict[str, Any]:
    """Write the mount of a phone that is the object."""
    save_mount(identity_mount(), target)
    return {}


def by_hand(target: Path, way: DrawingWay | PointsWay) -> dict[str, Any]:
    """Write the mount of a drawing or of points; returns how far off each of the points is.

    Raises:
        InputError: what is said does not determine the mount, or does not fit.
    """
    if isinstance(way, DrawingWay):
        mount = by_drawing(way)
        write_mount(mount, target, way.mesh_file, mount.phone, picture=None)
        return {}
    picked = by_points(way)
    write_mount(picked.mount, target, way.mesh_file, picked.mount.phone, picture=None)
    residuals = zip(pairs_of(way), picked.fit.residuals, strict=True)
    return {"points": [{"phone": pair.name, "off_mm": 1e3 * float(off)} for pair, off in residuals]}
