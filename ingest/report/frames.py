"""A few images of a session, decoded when they are asked for."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import av
import av.error
import cv2
import numpy as np
from av.container import InputContainer
from jaxtyping import Float64, UInt8

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
    try:
        with av.open(str(session.video)) as container:
            stamps, keys = _stamps(container)
        # Stray Scanner stamps its first frame before zero, and some tools drop it.
        late = 1 if len(stamps) == len(image_times(session)) - 1 else 0
        index_of = {stamps[k - late]: k for k in wanted if 0 <= k - late < len(stamps)}
        with av.open(str(session.video)) as container:
            for stamp, picture in _decoded(container, sorted(index_of), keys):
                yield index_of[stamp], picture
    except (av.error.FFmpegError, IndexError):
        return


def _stamps(container: InputContainer) -> tuple[list[int], list[int]]:
    """Stamp of each frame in the order of showing, and those of the key frames."""
    packets = [(p.pts, p.is_keyframe) for p in container.demux(video=0) if p.pts is not None]
    return sorted(pts for pts, _ in packets), sorted(pts for pts, key in packets if key)


def _decoded(
    container: InputContainer, stamps: Sequence[int], keys: Sequence[int]
) -> Iterator[tuple[int, Picture]]:
    """The frames with these stamps, decoded once from the key frame before each group of them."""
    stream = container.streams.video[0]
    stream.thread_type = "AUTO"
    key_of = np.array(keys)[np.searchsorted(keys, stamps, "right") - 1]
    for key in np.unique(key_of).tolist():
        asked = {stamp for stamp, own in zip(stamps, key_of, strict=True) if own == key}
        container.seek(key, stream=stream)
        for frame in container.decode(stream):
            if frame.pts in asked:
                yield frame.pts, frame.to_ndarray(format="gray")
            if frame.pts is not None and frame.pts >= max(asked):
                break
