"""A few images of a session, decoded when they are asked for."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import av.error
import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from ingest.film import frames_of, stamps_of
from ingest.session import CaptureSession

WIDTH = 640
"""Pixels; features of larger images take longer to find and tell no more about axes."""

Picture = UInt8[np.ndarray, "height width"]


def image_times(session: CaptureSession) -> Float64[np.ndarray, " images"]:
    """Seconds at which the images were taken, on the clock of the poses; none without images."""
    if session.images is None and session.video is None:
        return np.empty(0)
    return session.times if session.video_times is None else session.video_times


def pictures(session: CaptureSession, wanted: Sequence[int]) -> dict[int, Picture]:
    """Images by their place in `image_times`: grey, landscape, not wider than `WIDTH`.

    Of a video only the stretches from a key frame to a wanted image are decoded. What cannot be
    read is left out.
    """
    found = _files(session.images, wanted) if session.images else _film(session, wanted)
    return {index: _prepared(picture, session.image_turns) for index, picture in found}


def _prepared(picture: UInt8[np.ndarray, "rows columns"], turns: int) -> Picture:
    landscape = np.ascontiguousarray(np.rot90(picture, turns))
    height, width = landscape.shape
    if width <= WIDTH:
        return landscape
    size = WIDTH, max(1, round(height * WIDTH / width))
    return np.asarray(cv2.resize(landscape, size, interpolation=cv2.INTER_AREA), np.uint8)


def _files(files: Sequence[Path], wanted: Sequence[int]) -> Iterator[tuple[int, Picture]]:
    # What the file says of its orientation is the app's for viewers, not that of the sensor.
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    for index in wanted:
        picture = cv2.imread(str(files[index]), flags)
        if picture is not None:
            yield index, np.asarray(picture, np.uint8)


def _film(session: CaptureSession, wanted: Sequence[int]) -> Iterator[tuple[int, Picture]]:
    if session.video is None:
        return
    try:
        # Stray Scanner stamps its first frame before zero, and some tools drop it.
        late = 1 if len(stamps_of(session.video)) == len(image_times(session)) - 1 else 0
        for place, frame in frames_of(session.video, [k - late for k in wanted]):
            yield place + late, frame.to_ndarray(format="gray")
    except (av.error.FFmpegError, IndexError):
        return
