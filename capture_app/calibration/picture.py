"""The picture beside a mount file."""

from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from ingest.calibration.phone_body import Phone, phone_body, phone_named
from ingest.mount import Mount
from ingest.uncertainty import bounds_95
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh
from render.mount_view import mount_picture
from render.stills import write_png

_ANY_PHONE = "iPhone 13"
"""Drawn where the model is not known; phones differ by millimetres."""


def draw_mount(mount: Mount, mesh: ObjectMesh, path: Path) -> None:
    """Draw the object, in metres, with the phone on it into a PNG file."""
    label = mount.method
    if mount.covariance is not None:
        bounds = bounds_95(mount.covariance)
        label += f": {bounds.mm:.1f} mm, {bounds.deg:.1f} deg"
    write_png(path, mount_views(mount, mesh, label=label))


def mount_views(
    mount: Mount, mesh: ObjectMesh, *, label: str = "", side: int = 420
) -> UInt8[np.ndarray, "h w 3"]:
    """Three views of the object, in metres, with the phone on it, beside each other.

    Args:
        mount: where the phone is.
        mesh: of the object.
        label: in the corner of the first view.
        side: of each view, pixels.
    """
    phone = _drawn_phone(mount.phone)
    T_phone_body = phone_body(phone)[0]
    return mount_picture(
        mesh, mount.T_phone_object, T_phone_body, phone.body, label=label, side=side
    )


def _drawn_phone(name: str) -> Phone:
    try:
        return phone_named(name)
    except InputError:
        return phone_named(_ANY_PHONE)
