"""What the phone filmed, as a few small pictures a second."""

from collections.abc import Iterator
from dataclasses import dataclass

import av
import cv2
import numpy as np
from av.error import FFmpegError
from jaxtyping import Float64, Int, UInt8

from capture_app.overlay.film import RGB, TimedPictures, open_film
from ingest.film import frames_of
from ingest.session import CaptureSession
from omomo_core.errors import InputError

_RATE = 5.0
"""Pictures a second."""
_WIDTH = 320
"""Pixels along the longer side."""
_MOST = 900
"""Pictures; a longer film is shown with fewer a second."""
_MOST_BYTES = 20 * 10**6
_QUALITY = 72


@dataclass(frozen=True)
class FilmStrip:
    """Small JPEGs of a film, upright."""

    times: Float64[np.ndarray, " pictures"]
    """Seconds on the clock that was asked for."""
    pictures: tuple[bytes, ...]
    size: tuple[int, int]
    """Width and height of each."""


def film_strip(session: CaptureSession, start: float, stop: float, turns: int) -> FilmStrip | None:
    """The film between two moments; None where the phone filmed nothing then.

    A film that ends in damaged pictures is shown as far as it goes.

    Args:
        session: what the phone logged.
        start: second on the session's clock that becomes 0.
        stop: second on the session's clock.
        turns: counter-clockwise quarter turns that bring up to the top.
    """
    try:
        film = open_film(session)
    except InputError:
        return None
    wanted = _wanted(film.times, start, stop)
    times: list[float] = []
    pictures: list[bytes] = []
    size, total = (0, 0), 0
    for index, picture in zip(wanted, _small(session, film, wanted), strict=False):
        upright = np.ascontiguousarray(np.rot90(picture, turns))
        jpeg = _jpeg(upright)
        total += len(jpeg)
        if total > _MOST_BYTES:
            break
        size = (upright.shape[1], upright.shape[0])
        times.append(float(film.times[index] - start))
        pictures.append(jpeg)
    return FilmStrip(np.array(times), tuple(pictures), size) if pictures else None


def _wanted(
    times: Float64[np.ndarray, " images"], start: float, stop: float
) -> Int[np.ndarray, " wanted"]:
    """Places of the pictures to show."""
    step = max(1 / _RATE, (stop - start) / _MOST)
    grid = np.arange(start, stop + 0.5 * step, step)
    nearest = np.unique(np.searchsorted(times, grid).clip(0, len(times) - 1))
    return nearest[(times[nearest] >= start - step) & (times[nearest] <= stop + step)]


def _small(
    session: CaptureSession, film: TimedPictures, wanted: Int[np.ndarray, " wanted"]
) -> Iterator[RGB]:
    """The wanted pictures in the phone's landscape, made small."""
    try:
        if session.images is not None or session.video is None:
            for index in wanted.tolist():
                yield _shrunk(next(iter(film.read(index, index + 1))))
        else:
            for _, frame in frames_of(session.video, wanted.tolist()):
                yield np.ascontiguousarray(np.rot90(_reduced(frame), session.image_turns))
    except (FFmpegError, IndexError, InputError, OSError):
        return


def _reduced(frame: av.VideoFrame) -> RGB:
    """Made small before the codec's colours are turned into ours."""
    width, height = _fitted(frame.width, frame.height)
    return frame.reformat(width=width, height=height, format="rgb24").to_ndarray()


def _shrunk(picture: RGB) -> RGB:
    size = _fitted(picture.shape[1], picture.shape[0])
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _fitted(width: int, height: int) -> tuple[int, int]:
    scale = min(1.0, _WIDTH / max(width, height))
    return max(2, round(width * scale)), max(2, round(height * scale))


def _jpeg(picture: UInt8[np.ndarray, "h w 3"]) -> bytes:
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
