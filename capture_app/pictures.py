"""What all files of pictures have in common: endings, times, and progress while they are written."""

from collections.abc import Iterator
from pathlib import Path

from capture_app.progress import Progress
from omomo_core.errors import InputError
from omomo_core.motion import FPS
from render.stills import write_png
from render.strips import Picture
from render.video import write_moving

SMALL = (".webp", ".gif")
"""Loops for web pages: they have half as many pictures a second as a video."""
MOVING = (".mp4", *SMALL)


def stride(path: Path) -> int:
    """Frames of the motion from one picture of a file to its next."""
    return 2 if path.suffix in SMALL else 1


def frame_at(seconds: float, count: int) -> int:
    """The frame that is shown at a time.

    Raises:
        InputError: ``time-outside``.
    """
    frame = round(seconds * FPS)
    if not 0 <= frame < count:
        raise InputError(
            "time-outside",
            f"There is no picture at {seconds:g} s: the motion lasts {count / FPS:.2f} s.",
            where="--still",
            fix="Give a time within the motion.",
        )
    return frame


def with_progress(pictures: Iterator[Picture], count: int, progress: Progress) -> Iterator[Picture]:
    """Yield the pictures, and report the fraction that has gone by as progress of the stage "video"."""
    for k, picture in enumerate(pictures):
        yield picture
        progress("video", (k + 1) / count)


def save_pictures(path: Path, pictures: Iterator[Picture]) -> None:
    """Write pictures as the file's ending says: a .png the first, others all, at their stride.

    Raises:
        InputError: the file cannot be written.
    """
    if path.suffix == ".png":
        write_png(path, next(pictures))
    else:
        write_moving(path, pictures, FPS / stride(path))
