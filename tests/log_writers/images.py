"""Write the pictures of a session's film as files of their own."""

import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from ingest.formats.still_images import _made, _of_poses
from ingest.session import CaptureSession
from omomo_core.errors import InputError


def write_images(session: CaptureSession, target: Callable[[int], Path], turns: int) -> None:
    """Write the session's single images, turned by quarter turns counter-clockwise.

    Args:
        session: an image at the time of no pose is left out: these layouts cannot hold it.
        target: file to write for the image of a pose; its folder is made.
        turns: 0 copies a file of the same kind byte by byte.
    """
    if session.images is None or session.video_times is None:
        return
    for i, source in _of_poses(session.times, session.video_times, session.images):
        new = _made(target(i))
        if turns % 4 == 0 and source.suffix.lower() == new.suffix:
            shutil.copyfile(source, new)
            continue
        picture = cv2.imread(str(source), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        if picture is None:
            raise InputError("image-damaged", f"{source.name} is no picture.", where=str(source))
        cv2.imwrite(str(new), np.ascontiguousarray(np.rot90(picture, turns)))
