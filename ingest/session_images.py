"""A few images of a session, decoded when they are asked for."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from ingest.film import Film, FilmPairs, film_at, frames_of, pairs_of
from ingest.session import CaptureSession
from omomo_core.errors import InputError

WIDTH = 640
"""Pixels; features of larger images take longer to find and tell no more about axes."""

Picture = UInt8[np.ndarray, "height width"]


def image_times(session: CaptureSession) -> Float64[np.ndarray, " images"]:
    """Seconds at which the images were taken, on the clock of the poses; none without images."""
    if session.images is None and session.video is None:
        return np.empty(0)
    return session.times if session.video_times is None else session.video_times


def film_and_pairs(session: CaptureSession, video: Path) -> tuple[Film, FilmPairs]:
    """The film of a session, and which of its frames is which of `image_times`.

    Everything that uses a session's film asks here.

    Raises:
        InputError: "no-video" where it cannot be read, "film-unpaired" where nothing pairs them.
    """
    film = film_at(video)
    return film, pairs_of(film, image_times(session), session.video_numbers)


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
        _, pairs = film_and_pairs(session, session.video)
        image_of = dict(zip(pairs.frames.tolist(), pairs.images.tolist(), strict=True))
        chosen = set(wanted)
        asked = [frame for frame, image in image_of.items() if image in chosen]
        for frame, picture in frames_of(session.video, asked):
            yield image_of[frame], picture.to_ndarray(format="gray")
    except InputError:
        return  # the motion needs no film, and the check of the film says what is wrong with it
