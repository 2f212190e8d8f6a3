"""`omocap render`: draw the video or a picture of a result."""

from pathlib import Path
from typing import TYPE_CHECKING

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars, say
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from capture_app.result import Result


def render(
    result: given.Result,
    file: given.OutputFile = None,
    sample: given.Sample = None,
    size: given.Size = "960x540",
    still: given.Still = None,
    markers: given.Markers = True,
    backend: given.Backend = given.DrawingBackend.auto,
) -> None:
    """Draw a result again: another size, another sample, or a single picture.

    Example: `omocap render chair_motion --size 1920x1080 -o chair.mp4`
    """
    width, height = given.picture_size(size, "--size")
    from capture_app.result import body_of, load_result
    from omomo_core.motion import FPS
    from render.stills import write_png
    from render.third_person import frames
    from render.video import write_video

    loaded = load_result(result)
    index = _sample(loaded, sample)
    count = len(loaded.object_motion.valid)
    frame = None if still is None else _frame(still, count)
    target = file or result / _default_name(index, frame)
    _check_folder(target)
    pictures = frames(
        loaded.motions[index],
        loaded.object_motion,
        body_of(loaded),
        width=width,
        height=height,
        markers=markers,
        backend=backend.value,
        only=None if frame is None else [frame],
    )
    with progress_bars() as progress:
        if frame is not None:
            write_png(target, next(pictures))
        else:
            told = (progress("video", (k + 1) / count) or p for k, p in enumerate(pictures))
            write_video(target, told, FPS)
    say("Done", str(target), "green")


def _sample(result: "Result", wanted: int | None) -> int:
    count = len(result.motions)
    if wanted is None:
        return result.manifest.chosen
    if not 1 <= wanted <= count:
        raise InputError(
            "sample-missing",
            f"There is no sample {wanted}: the result has {count}.",
            where=str(result.folder),
            fix=f"Give --sample a number from 1 to {count}.",
        )
    return wanted - 1


def _frame(seconds: float, count: int) -> int:
    frame = round(seconds * 30)
    if not 0 <= frame < count:
        raise InputError(
            "time-outside",
            f"There is no picture at {seconds:g} s: the motion lasts {count / 30:.2f} s.",
            where="--still",
            fix="Give a time within the motion.",
        )
    return frame


def _default_name(sample: int, frame: int | None) -> str:
    return f"sample_{sample + 1}.mp4" if frame is None else f"sample_{sample + 1}_{frame:05d}.png"


def _check_folder(file: Path) -> None:
    if not file.parent.is_dir():
        raise InputError(
            "output-not-writable",
            "The folder for the output file does not exist.",
            where=str(file.parent),
            fix="Make it, or give another file with -o.",
        )
