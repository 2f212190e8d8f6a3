"""session_source: what an app logged while it filmed the object, with its pictures and depth."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from ingest.formats.axes import opencv_poses
from ingest.scan.sources.stills import Stills
from ingest.scan.sources.video import film_of
from ingest.scan.types import Pictures, ScanSource
from ingest.session import CaptureSession
from ingest.session_images import image_times
from omomo_core.errors import InputError

_SAME_TIME = 0.05
"""Seconds between a picture and what belongs to it, at most."""
_SMALL = 2
"""The highest confidence where it is counted 0, 1, 2."""


def session_source(session: CaptureSession) -> ScanSource:
    """The pictures of a session with the poses of their moments.

    Poses are NaN where the phone says that it did not know them.

    Raises:
        InputError: "scan-no-pictures" when the app saved none, or what `film_of` refuses.
    """
    pictures = _pictures(session)
    times = image_times(session)[: len(pictures.names)]
    pose = _nearest(session.times, times)
    T = opencv_poses(session.T_world_phone[pose])
    lost = np.abs(session.times[pose] - times) > _SAME_TIME
    if session.tracking_ok is not None:
        lost |= ~session.tracking_ok[pose]
    T[lost] = np.nan
    known = session.intrinsics is not None and session.image_size is not None
    return ScanSource(
        kind="session",
        where=session.source,
        pictures=pictures,
        image_size=session.image_size if known else None,
        intrinsics=session.intrinsics[pose] if known and session.intrinsics is not None else None,
        T_world_camera=T,
        upright=session.gravity_aligned,
        times=times,
        depth=_depth(session, times),
    )


def _pictures(session: CaptureSession) -> Pictures:
    turns = session.image_turns % 4
    if session.images is not None:
        return Stills(session.images, tuple(file.stem for file in session.images), turns)
    if session.video is not None:
        return film_of(session.video, expected=len(image_times(session)), turns=turns)
    raise InputError(
        "scan-no-pictures",
        f"The session of {session.app} holds no pictures and no video.",
        where=str(session.source),
        fix="Film the object with an app that saves what it sees, such as Stray Scanner, 3D Scanner "
        "App (All Data) or Record3D; or give a plain video.",
    )


def _nearest(
    times: Float64[np.ndarray, " log"], wanted: Float64[np.ndarray, " wanted"]
) -> np.ndarray:
    """The entry of a log that is nearest in time."""
    after = np.searchsorted(times, wanted).clip(1, max(1, len(times) - 1))
    before = after - 1
    after = after.clip(max=len(times) - 1)
    return np.where(wanted - times[before] <= times[after] - wanted, before, after)


def _depth(
    session: CaptureSession, times: Float64[np.ndarray, " pictures"]
) -> Callable[[int], Float32[np.ndarray, "height width"] | None] | None:
    log = session.depth
    if log is None or not len(log.times):
        return None
    nearest = _nearest(log.times, times)

    def load(picture: int) -> Float32[np.ndarray, "height width"] | None:
        k = int(nearest[picture])
        if abs(log.times[k] - times[picture]) > _SAME_TIME:
            return None
        file: Path = log.files[k]
        metres = sure(log.load(file), confidence_of(file))
        return np.ascontiguousarray(np.rot90(metres, session.image_turns))

    return load


def confidence_of(depth: Path) -> UInt8[np.ndarray, "height width"] | None:
    """The confidence of a depth map, 0 (least) to 2, None where there is none."""
    beside = depth.with_name(depth.name.replace("depth_", "conf_", 1))
    folder = depth.parent.parent / "confidence" / depth.name
    file = next((f for f in (beside, folder) if f != depth and f.is_file()), None)
    found = None if file is None else cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    if found is None or found.ndim != 2:
        return None
    levels = found if found.max(initial=0) <= _SMALL else np.rint(found / 127.5)
    return np.asarray(levels, np.uint8)


def sure(
    metres: Float32[np.ndarray, "height width"],
    confidence: UInt8[np.ndarray, "height width"] | None,
) -> Float32[np.ndarray, "height width"]:
    """The depth with 0 where its confidence is the lowest."""
    if confidence is None or confidence.shape != metres.shape:
        return metres
    return np.where(confidence > 0, metres, np.float32(0))
