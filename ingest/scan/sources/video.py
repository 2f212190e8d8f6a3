"""VideoFrames: the frames of a video as pictures, never more than one of them in memory."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import av
import av.error
import numpy as np

from ingest.film import frames_of, size_of, stamps_of
from ingest.scan.sources.stills import MAX_PIXELS
from ingest.scan.types import Colours, Grey, ScanSource
from omomo_core.errors import InputError

SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")


@dataclass(frozen=True)
class VideoFrames:
    """The frames of a video, by number."""

    path: Path
    names: tuple[str, ...]
    turns: int | None = None
    """Quarter turns counter-clockwise that bring its frames upright; None: as the file says."""
    late: int = 0
    """How many of the first frames the file does not hold."""

    def greys(self, wanted: Sequence[int], width: int) -> Iterator[tuple[int, Grey]]:
        """Some of them, small; see `Pictures`."""
        for index, frame in self._frames(wanted):
            scale = min(1.0, width / max(frame.width, frame.height))
            size = max(1, round(frame.width * scale)), max(1, round(frame.height * scale))
            small = frame.reformat(*size, format="gray", interpolation="AREA")
            yield index, self._upright(small.to_ndarray(), frame)

    def colours(self, wanted: Sequence[int]) -> Iterator[tuple[int, Colours]]:
        """Some of them as they are; see `Pictures`."""
        for index, frame in self._frames(wanted):
            yield index, self._upright(frame.to_ndarray(format="rgb24"), frame)

    def _frames(self, wanted: Sequence[int]) -> Iterator[tuple[int, av.VideoFrame]]:
        try:
            for index, frame in frames_of(self.path, [k - self.late for k in wanted]):
                yield index + self.late, frame
        except (av.error.FFmpegError, IndexError, OSError) as problem:
            raise unreadable(self.path, problem) from None

    def _upright(self, picture: np.ndarray, frame: av.VideoFrame) -> np.ndarray:
        # PyAV tells degrees counter-clockwise, as np.rot90 turns.
        turns = round(frame.rotation / 90) if self.turns is None else self.turns
        return np.ascontiguousarray(np.rot90(picture, turns))


def film_of(path: Path, *, expected: int | None = None, turns: int | None = None) -> VideoFrames:
    """A video, once its index has been read.

    Args:
        path: of the video.
        expected: frames that a log knows of; where the file has one less, its first is missing.
        turns: see `VideoFrames`.

    Raises:
        InputError: "video-unreadable" or "video-large".
    """
    count = len(_stamps(path))
    # Stray Scanner stamps its first frame before zero, and some tools drop it.
    late = 1 if expected == count + 1 else 0
    return VideoFrames(path, tuple(f"{k:05d}" for k in range(count + late)), turns, late)


def video_source(path: Path) -> ScanSource:
    """A plain video, turned upright as it says.

    Raises:
        InputError: "video-unreadable" or "video-large".
    """
    film = film_of(path)
    with av.open(str(path)) as container:
        base = float(container.streams.video[0].time_base or 0)
    times = np.array(_stamps(path)) * base
    return ScanSource("video", path, film, times=times)


def _stamps(path: Path) -> list[int]:
    try:
        with av.open(str(path)) as container:
            width, height = size_of(container)
            pixels = width * height
        stamps = stamps_of(path)
    except (av.error.FFmpegError, IndexError, OSError) as problem:
        raise unreadable(path, problem) from None
    if pixels > MAX_PIXELS:
        raise InputError(
            "video-large",
            f"{path.name} has {pixels / 1e6:.0f} megapixels a frame.",
            where=str(path),
            fix="Film in 4K or less.",
        )
    if not stamps:
        raise unreadable(path, ValueError("it holds no frames"))
    return stamps


def unreadable(path: Path, problem: Exception) -> InputError:
    """The refusal of a video."""
    return InputError(
        "video-unreadable",
        f"No video can be read: {problem}.",
        where=str(path),
        fix="Copy the file from the phone again; MP4 or MOV as the camera app writes it.",
    )
