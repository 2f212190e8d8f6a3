"""Grey pictures with their times from a video, a folder or a session, no more than are needed."""

import csv
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
from av.error import FFmpegError

from ingest.calibration.board.detect import Grey
from ingest.formats.pictures import picture_size
from ingest.session import CaptureSession
from omomo_core.errors import InputError

MAX_PIXELS = 50_000_000
MAX_PICTURES = 20_000
_SUFFIXES = (".png", ".jpg", ".jpeg")
TIMES = "times.csv"


class Picture(NamedTuple):
    """One picture."""

    time: float
    """Seconds, on the clock of its source."""
    grey: Grey


Progress = Callable[[str, float], None]


class _Pace:
    """Lets times through, `rate` a second at most."""

    def __init__(self, rate: float) -> None:
        self._step, self._next = 1 / rate, -np.inf

    def due(self, time: float) -> bool:
        if time < self._next - 1e-6:
            return False
        # A late one does not delay those after it, unless it is later than a whole step.
        late = time - self._next >= self._step
        self._next = (time if late else self._next) + self._step
        return True


def of_video(path: Path, rate: float, progress: Progress) -> Iterator[Picture]:
    """Pictures of a video, `rate` a second at most; times as the file stamps them.

    A phone's turning of the video for viewers is not applied: pictures are as the sensor sees.

    Raises:
        InputError: "no-video" or "video-bounds".
    """
    pace, count = _Pace(rate), 0
    for _, frame, length in _decoded(path):
        if frame.pts is None or not pace.due(frame.time):
            continue
        count += 1
        if count > MAX_PICTURES or frame.width * frame.height > MAX_PIXELS:
            raise _beyond(path)
        yield Picture(frame.time, frame.to_ndarray(format="gray"))
        progress("board", min(frame.time / length, 1.0) if length else 0.0)


def _decoded(path: Path) -> Iterator[tuple[int, av.VideoFrame, float]]:
    """Number and frame in the order of showing, and the video's length in seconds (0: unknown)."""
    try:
        with av.open(str(path)) as container:
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            length = (container.duration or 0) / av.time_base
            for index, frame in enumerate(container.decode(stream)):
                yield index, frame, length
    except (FFmpegError, IndexError, OSError) as problem:
        raise InputError(
            "no-video",
            f"No video can be read: {problem}.",
            where=str(path),
            fix="Give a video file such as MP4 or MOV, or a folder of pictures.",
        ) from None


def of_folder(folder: Path, progress: Progress) -> Iterator[Picture]:
    """Pictures of a folder whose times.csv says `file,seconds` in each line.

    Raises:
        InputError: "times-missing", "times-unreadable", "image-damaged" or "video-bounds".
    """
    rows = _times(folder)
    for index, (file, time) in enumerate(rows):
        size = picture_size(file)
        if size is not None and size[0] * size[1] > MAX_PIXELS:
            raise _beyond(file)
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            raise InputError("image-damaged", f"{file.name} is no picture.", where=str(file))
        yield Picture(time, np.asarray(grey, np.uint8))
        progress("board", (index + 1) / len(rows))


def _times(folder: Path) -> list[tuple[Path, float]]:
    path = folder / TIMES
    if not path.is_file():
        raise InputError(
            "times-missing",
            "The folder of pictures does not say when they were taken.",
            where=str(folder),
            fix=f"Add {TIMES} with a line 'file,seconds' for each picture; or give a video.",
        )
    rows: list[tuple[Path, float]] = []
    with path.open(newline="", encoding="utf-8") as file:
        for number, row in enumerate(csv.reader(file), start=1):
            if number == 1 and row[-1:] and not _is_number(row[-1]):
                continue
            name = Path(row[0]).name if row else ""
            if len(row) != 2 or not _is_number(row[1]) or not name.lower().endswith(_SUFFIXES):
                raise InputError(
                    "times-unreadable",
                    f"Line {number} is not 'file,seconds' with a PNG or JPEG.",
                    where=str(path),
                    fix="Write lines such as 0001.png,12.3667.",
                )
            rows.append((folder / name, float(row[1])))
    if len(rows) > MAX_PICTURES:
        raise _beyond(path)
    return sorted(rows, key=lambda row: row[1])


def of_session(session: CaptureSession, rate: float, progress: Progress) -> Iterator[Picture]:
    """Pictures of a session in landscape, `rate` a second at most, on the clock of its poses.

    Raises:
        InputError: "no-video" when the session has neither video nor images.
    """
    times = session.times if session.video_times is None else session.video_times
    pace = _Pace(rate)
    wanted = {index for index, time in enumerate(times.tolist()) if pace.due(time)}
    stored = _images(session.images, wanted) if session.images else _film(session, wanted)
    for index, grey in stored:
        landscape = np.ascontiguousarray(np.rot90(grey, session.image_turns))
        yield Picture(float(times[index]), landscape)
        progress("board", (index + 1) / len(times))


def _images(files: Sequence[Path], wanted: set[int]) -> Iterator[tuple[int, Grey]]:
    for index in sorted(wanted):
        grey = cv2.imread(str(files[index]), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is not None:
            yield index, np.asarray(grey, np.uint8)


def _film(session: CaptureSession, wanted: set[int]) -> Iterator[tuple[int, Grey]]:
    if session.video is None:
        raise InputError(
            "no-video",
            "The session holds no video and no images.",
            where=str(session.source),
            fix="Record the witness with an app that saves its video, or use a plain video.",
        )
    times = session.times if session.video_times is None else session.video_times
    # Stray Scanner stamps its first frame before zero, and some tools drop it.
    late = 1 if _length(session.video) == len(times) - 1 else 0
    for index, frame, _ in _decoded(session.video):
        if index + late in wanted:
            yield index + late, frame.to_ndarray(format="gray")


def _length(path: Path) -> int:
    """Number of pictures that the video's index states."""
    try:
        with av.open(str(path)) as container:
            return container.streams.video[0].frames
    except (FFmpegError, IndexError, OSError):
        return 0


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _beyond(path: Path) -> InputError:
    return InputError(
        "video-bounds",
        f"The pictures are more than {MAX_PICTURES}, or larger than {MAX_PIXELS // 10**6} MP.",
        where=str(path),
        fix="Cut out the part that shows the board, a minute or two.",
    )
