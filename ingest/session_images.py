"""Images of a session: what their files state, whether these are whole, and a few of them decoded."""

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


_JPEG_SIZES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of the segments that hold height and width."""
_PNG = b"\x89PNG\r\n\x1a\n"


def picture_size(path: Path) -> tuple[int, int] | None:
    """Width and height that a PNG or JPEG states, without decoding it; None for other files."""
    with path.open("rb") as file:
        return _stated_size(file.read(2**20))[0]


def _stated_size(data: bytes) -> tuple[tuple[int, int] | None, int]:
    """Width and height that a PNG or JPEG states, None for other data, and where its pixels may begin."""
    if data.startswith(_PNG) and len(data) >= 24:
        return (int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")), 24
    at = 2 if data.startswith(b"\xff\xd8") else len(data)
    while at + 9 <= len(data) and data[at] == 0xFF:
        if data[at + 1] in _JPEG_SIZES:
            height, width = (int.from_bytes(data[at + k : at + k + 2], "big") for k in (5, 7))
            return (width, height), at
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return None, len(data)


def is_whole(path: Path) -> bool:
    """Whether a file is a picture from its beginning to its end; a PNG or JPEG is not decoded for that."""
    try:
        data = path.read_bytes()
    except OSError:
        return False
    size, pixels = _stated_size(data)
    if size is None:
        return (
            cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_REDUCED_GRAYSCALE_8) is not None
        )
    end = b"IEND" if data.startswith(_PNG) else b"\xff\xd9"
    return min(size) > 0 and data.find(end, pixels) >= 0


_MOST_LEFT_OUT = 0.2
"""Part of the pictures that may be damaged while the others are used."""
_NAMED = 3


def left_out(names: Sequence[str], total: int, source: Path) -> str:
    """Return the sentence that tells of pictures that cannot be read and are left out; "" of none.

    Everything that uses pictures says it in these words.

    Args:
        names: of those that cannot be read, as a user knows them.
        total: of all pictures that were to be read.
        source: of the pictures.

    Raises:
        InputError: "pictures-damaged" where they are all, or a considerable part.
    """
    if not names:
        return ""
    if len(names) == total or len(names) > max(1, _MOST_LEFT_OUT * total):
        raise pictures_damaged(names, total, source)
    are = "is" if len(names) == 1 else "are"
    return f"{_cannot_be_read(names, total)} and {are} left out: {_listed(names)}."


def pictures_damaged(names: Sequence[str], total: int, source: Path) -> InputError:
    """The refusal of pictures of which too many cannot be read; arguments as of `left_out`."""
    return InputError(
        "pictures-damaged",
        f"{_cannot_be_read(names, total)}: {_listed(names)}.",
        where=str(source),
        fix="Copy them from the phone again.",
    )


def _cannot_be_read(names: Sequence[str], total: int) -> str:
    return f"{len(names)} of {total} pictures cannot be read"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"


def damaged_images(files: Sequence[Path]) -> list[str]:
    """Names of single images that are cut short or no pictures."""
    return [file.name for file in files if not is_whole(file)]


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
