"""Views: pictures that the clamped phone took while it stood still, from a session or a folder."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.calibration.scan.localise import PhonePicture
from ingest.calibration.still import Still
from ingest.session import CaptureSession
from ingest.session_images import image_times, pictures
from omomo_core.errors import InputError

_PER_STILL = 3
_PHOTOS = (".jpg", ".jpeg", ".png")


@dataclass(frozen=True)
class Views:
    """Pictures taken from one place."""

    name: str
    views: tuple[PhonePicture, ...]


def views_of(session: CaptureSession, still: Still) -> Views:
    """Up to three of the pictures that the phone took while it stood still.

    Raises:
        InputError: "scan-no-pictures" or "scan-no-camera".
    """
    if session.intrinsics is None or session.image_size is None:
        raise InputError(
            "scan-no-camera",
            f"{session.app} does not log the camera's focal length.",
            where=str(session.source),
            fix="Record with an app that does, such as Stray Scanner or 3D Scanner App.",
        )
    taken = image_times(session) - session.times[0]
    inside = np.flatnonzero((taken >= still.start) & (taken <= still.stop))
    spread = np.linspace(0, len(inside) - 1, _PER_STILL + 2)[1:-1].round().astype(int)
    wanted = np.unique(inside[spread]).tolist() if len(inside) else []
    found = pictures(session, wanted)
    if not found:
        raise InputError(
            "scan-no-pictures",
            f"There is no picture of what the phone saw while it stood still ({still}).",
            where=str(session.source),
            fix="Record with an app that films while it logs; or take photos with the clamped "
            "phone and give their folder.",
        )
    views: list[PhonePicture] = []
    for index, picture in found.items():
        pose = int(np.abs(session.times - session.times[0] - taken[index]).argmin())
        K = _scaled(session.intrinsics[pose], picture.shape[1] / session.image_size[0])
        views.append(PhonePicture(f"{session.source}, {taken[index]:.2f} s", picture, K))
    return Views(str(still), tuple(views))


def views_in(folder: Path, intrinsics: Float64[np.ndarray, "4"]) -> Views:
    """The photos in a folder, all taken by the clamped phone.

    Args:
        folder: of JPEG or PNG files in landscape, as the sensor is.
        intrinsics: fx, fy, cx, cy in pixels of the photos.

    Raises:
        InputError: "photos-missing" or "photos-upright".
    """
    views: list[PhonePicture] = []
    files = sorted(folder.glob("*")) if folder.is_dir() else []
    for file in (file for file in files if file.suffix.lower() in _PHOTOS):
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            continue
        if grey.shape[0] > grey.shape[1]:
            raise InputError(
                "photos-upright",
                "The photo is upright; which way the camera was turned cannot be told.",
                where=str(file),
                fix="Give the photos in landscape with the phone's bottom on the right, as the "
                "camera stores them, with the intrinsics of that.",
            )
        views.append(PhonePicture(str(file), np.asarray(grey, np.uint8), intrinsics))
    if not views:
        raise InputError(
            "photos-missing",
            "There is no photo in the folder.",
            where=str(folder),
            fix=f"Give a folder with {', '.join(_PHOTOS)} files.",
        )
    return Views(str(folder), tuple(views))


def _scaled(intrinsics: Float64[np.ndarray, "4"], factor: float) -> Float64[np.ndarray, "4"]:
    """Intrinsics of a picture that is smaller by a factor; pixel centres are at whole numbers."""
    fx, fy, cx, cy = intrinsics
    centre = (np.array([cx, cy]) + 0.5) * factor - 0.5
    return np.array([fx * factor, fy * factor, *centre])
