"""Film: the pictures of a camera in colour, each with its time, decoded as they are asked for."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np
from av.error import FFmpegError
from jaxtyping import Float64, UInt8

from ingest.film import frames_of, size_of, stamps_of
from ingest.session import CaptureSession
from omomo_core.errors import InputError

RGB = UInt8[np.ndarray, "h w 3"]
_MAX_PIXELS = 50_000_000


@dataclass(frozen=True)
class TimedPictures:
    """Pictures as the sensor sees them: what a file says of turning them for viewers is not applied."""

    source: Path
    times: Float64[np.ndarray, " pictures"]
    """Seconds on the film's own clock, increasing."""
    size: tuple[int, int]
    """Width and height."""
    read: Callable[[int, int], Iterator[RGB]]
    """The pictures from one to before another, by their place in `times`."""


def open_video(path: Path) -> TimedPictures:
    """A video file with the times that it stamps.

    Raises:
        InputError: "no-video" or "video-bounds".
    """
    times, size = _stamps(path)
    return TimedPictures(path, times, size, lambda start, stop: _decoded(path, start, stop))


def open_film(session: CaptureSession) -> TimedPictures:
    """What a phone filmed while it logged, or the single pictures that it took, on the clock of its poses.

    They are turned into landscape.

    Raises:
        InputError: "no-video" when it filmed nothing, or it cannot be decoded; "video-bounds".
    """
    known = session.times if session.video_times is None else session.video_times
    turns = session.image_turns
    if session.images:
        files = session.images
        height, width = _turned(_image(files[0]), turns).shape[:2]
        return TimedPictures(
            session.source,
            known,
            (width, height),
            lambda start, stop: (_turned(_image(file), turns) for file in files[start:stop]),
        )
    if session.video is None:
        raise InputError(
            "no-video",
            "The session holds no video and no images.",
            where=str(session.source),
            fix="Record with an app that films while it logs, or give the film of another camera "
            "with --video.",
        )
    video = session.video
    stamps, size = _stamps(video)
    # Stray Scanner stamps its first frame before zero, and some tools drop it.
    late = 1 if len(stamps) == len(known) - 1 else 0
    count = min(len(stamps), len(known) - late)

    def read(start: int, stop: int) -> Generator[RGB]:
        for picture in _decoded(video, start, stop):
            yield _turned(picture, turns)

    wide = size if turns % 2 == 0 else (size[1], size[0])
    return TimedPictures(video, known[late : late + count], wide, read)


def _stamps(path: Path) -> tuple[Float64[np.ndarray, " pictures"], tuple[int, int]]:
    """Second of each picture in the order of showing, and their size; nothing is decoded."""
    try:
        stamps = stamps_of(path)
        with av.open(str(path)) as container:
            size = size_of(container)
            tick = float(container.streams.video[0].time_base or 0)
    except (FFmpegError, IndexError, OSError) as problem:
        raise _unreadable(path, problem) from None
    if not stamps:
        raise _unreadable(path, "it holds no picture")
    if size[0] * size[1] > _MAX_PIXELS:
        raise InputError(
            "video-bounds",
            f"The pictures are larger than {_MAX_PIXELS // 10**6} megapixels.",
            where=str(path),
            fix="Give a smaller video.",
        )
    return np.array(stamps) * tick, size


def _decoded(path: Path, start: int, stop: int) -> Generator[RGB]:
    """The pictures from one to before another, by their places."""
    missing = stop - start
    try:
        for _, frame in frames_of(path, range(start, stop)):
            missing -= 1
            yield frame.to_ndarray(format="rgb24")
    except (FFmpegError, IndexError, OSError) as problem:
        raise _unreadable(path, problem) from None
    if missing:
        raise _unreadable(path, f"{missing} of its pictures are damaged")


def _image(path: Path) -> RGB:
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise InputError("image-damaged", f"{path.name} is no picture.", where=str(path))
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)


def _turned(picture: RGB, turns: int) -> UInt8[np.ndarray, "height width 3"]:
    return np.ascontiguousarray(np.rot90(picture, turns))


def _unreadable(path: Path, why: object) -> InputError:
    return InputError(
        "no-video",
        f"No video can be read: {why}.",
        where=str(path),
        fix="Give a video file such as MP4 or MOV that a player shows to its end, or a session.",
    )
