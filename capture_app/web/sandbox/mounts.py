"""Mounts from the numbers of a form, as `omocap calibrate drawing` and `points` find them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from capture_app.calibration.calibrate import need, write_mount
from capture_app.commands.inputs import MeshFile
from ingest.calibration.drawn_mount import Drawn, Precision, body_mount, camera_mount
from ingest.calibration.phone_body import Phone
from ingest.calibration.picked_points import mount_from_pairs
from ingest.calibration.point_pairs import PointPair
from ingest.mount import Mount, identity_mount
from ingest.mount_file import save_mount


def identity(target: Path) -> dict[str, Any]:
    """Write the mount of a phone that is the object."""
    save_mount(identity_mount(), target)
    return {}


def drawing(
    target: Path,
    drawn: Drawn,
    of: str,
    phone: Phone | None,
    point: str,
    precision: Precision,
    mesh_file: MeshFile | None,
) -> dict[str, Any]:
    """Write the mount of a holder whose drawing says where the phone is.

    Raises:
        InputError: the numbers do not make a pose, or the phone is needed and not given.
    """
    if of == "camera":
        return _written(camera_mount(drawn.of_camera(), precision), target, phone, mesh_file)
    T = drawn.of_body()
    return _written(
        body_mount(need(phone), T[:3, :3], T[:3, 3], point, precision), target, phone, mesh_file
    )


def points(
    target: Path,
    pairs: Sequence[PointPair],
    phone: Phone | None,
    scaled: bool,
    mesh_file: MeshFile | None,
) -> dict[str, Any]:
    """Write the mount that pairs of points give; returns how far off each of them is.

    Raises:
        InputError: the points do not determine it, or do not fit.
    """
    picked = mount_from_pairs(pairs, phone, scaled=scaled)
    _written(picked.mount, target, phone, mesh_file)
    residuals = zip(pairs, picked.fit.residuals, strict=True)
    return {"points": [{"phone": pair.name, "off_mm": 1e3 * float(off)} for pair, off in residuals]}


def _written(
    mount: Mount, target: Path, phone: Phone | None, mesh_file: MeshFile | None
) -> dict[str, Any]:
    write_mount(mount, target, mesh_file, phone.name if phone else "", picture=None)
    return {}
