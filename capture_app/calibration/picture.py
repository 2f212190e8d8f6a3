"""The picture beside a mount file."""

from pathlib import Path

from ingest.mount.mount import Mount
from ingest.mount.phone.body import Phone, phone_body, phone_named
from ingest.mount.uncertainty import bounds_95
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh
from render.mount_view import mount_picture
from render.stills import write_png

_ANY_PHONE = "iPhone 13"
"""Drawn where the model is not known; phones differ by millimetres."""


def draw_mount(mount: Mount, mesh: ObjectMesh, path: Path) -> None:
    """Draw the object with the phone on it into a PNG file."""
    phone = _drawn_phone(mount.phone)
    label = mount.method
    if mount.covariance is not None:
        bounds = bounds_95(mount.covariance)
        label += f": {bounds.mm:.1f} mm, {bounds.deg:.1f} deg"
    picture = mount_picture(
        mesh, mount.T_phone_object, phone_body(phone)[0], phone.body, label=label
    )
    write_png(path, picture)


def _drawn_phone(name: str) -> Phone:
    try:
        return phone_named(name)
    except InputError:
        return phone_named(_ANY_PHONE)
