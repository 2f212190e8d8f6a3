"""Mounts from the numbers of a form, as `omocap calibrate drawing` and `points` find them."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from capture_app.web.sources import Solid
from ingest.mesh import load_mesh
from ingest.mount.drawing.drawing import Precision, body_mount, camera_mount
from ingest.mount.drawing.drawn import Drawn
from ingest.mount.file import save_mount
from ingest.mount.identity import object_id
from ingest.mount.mount import Mount, identity_mount
from ingest.mount.phone.body import Phone, phone_named
from ingest.mount.points.correspondences import Pair
from ingest.mount.points.picked import mount_from_pairs
from omomo_core.errors import InputError

Ruler = tuple[float, float, float, float]
"""Width and height of a phone's body, its lens from the top and from the right edge, millimetres."""


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
    solid: Solid | None,
) -> dict[str, Any]:
    """Write the mount of a holder whose drawing says where the phone is.

    Raises:
        InputError: the numbers do not make a pose, or the phone is needed and not given.
    """
    if of == "camera":
        return _written(camera_mount(drawn.of_camera(), precision), target, phone, solid)
    if phone is None:
        raise InputError(
            "phone-needed",
            "The model of the phone is not given.",
            where="phone",
            fix="Choose the model, or measure the phone with a ruler.",
        )
    T = drawn.of_body()
    return _written(body_mount(phone, T[:3, :3], T[:3, 3], point, precision), target, phone, solid)


def points(
    target: Path, pairs: Sequence[Pair], phone: Phone | None, scaled: bool, solid: Solid | None
) -> dict[str, Any]:
    """Write the mount that pairs of points give; returns how far off each of them is.

    Raises:
        InputError: the points do not determine it, or do not fit.
    """
    picked = mount_from_pairs(pairs, phone, scaled=scaled)
    _written(picked.mount, target, phone, solid)
    residuals = zip(pairs, picked.fit.residuals, strict=True)
    return {"points": [{"phone": pair.name, "off_mm": 1e3 * float(off)} for pair, off in residuals]}


def phone_of(name: str | None, ruler: Ruler | None) -> Phone | None:
    """The phone of a form; None when it says nothing of it.

    Raises:
        InputError: as `phone_named`.
    """
    if ruler is not None:
        return phone_named(name or "measured phone", ruler)
    return phone_named(name) if name else None


def _written(
    mount: Mount, target: Path, phone: Phone | None, solid: Solid | None
) -> dict[str, Any]:
    told = replace(
        mount,
        date=date.today().isoformat(),
        phone=phone.name if phone else mount.phone,
        object_id=_object_id(mount, solid) if solid else mount.object_id,
    )
    save_mount(told, target)
    return {}


def _object_id(mount: Mount, solid: Solid) -> str:
    mesh = load_mesh(solid.path, scale=solid.scale * mount.object_scale)
    return object_id(mesh, mount.object_scale)
