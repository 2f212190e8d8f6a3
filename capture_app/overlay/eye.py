"""The phone that was clamped to the object of a result: where it sat, and what it saw."""

import numpy as np

from capture_app.rerun import unchanged
from capture_app.result import Result
from ingest.formats.registry import read_session
from ingest.mount import Mount, identity_mount
from ingest.mount_file import load_mount
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from render.views import Eye


def eye_of(result: Result) -> Eye | None:
    """The phone's camera as it rides on the object; None where the object had no phone.

    Raises:
        InputError: the session or the mount is not where it was, or not what it was.
    """
    if result.manifest.options.get("animated"):
        return None
    T_object_phone = inverse(mount_of(result).T_phone_object)
    session = session_of(result)
    if session.intrinsics is None or session.image_size is None:
        return Eye(T_object_phone)
    focal = float(np.median(session.intrinsics[:, :2]))
    return Eye(T_object_phone, 2 * float(np.arctan(np.hypot(*session.image_size) / 2 / focal)))


def mount_of(result: Result) -> Mount:
    """Where the object is in the phone's frame; the identity where no file says it.

    Raises:
        InputError: the mount is not where it was, or not what it was.
    """
    given = [item for item in result.manifest.inputs if item.role == "mount"]
    return load_mount(unchanged(given[0])) if given else identity_mount()


def session_of(result: Result) -> CaptureSession:
    """What the clamped phone logged.

    Raises:
        InputError: "overlay-no-phone" for an object that moved by itself; the session is not where it
            was, or not what it was.
    """
    if result.manifest.options.get("animated"):
        raise InputError(
            "overlay-no-phone",
            "No phone was clamped to this object; it moved by itself.",
            where=str(result.folder),
            fix="Give the video of a camera that watched, with --camera or --board.",
        )
    log = unchanged(next(item for item in result.manifest.inputs if item.role == "session"))
    format_ = result.manifest.options.get("format")
    return read_session(log, str(format_) if format_ else None)
