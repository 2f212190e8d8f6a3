"""`omocap render`: draw the video or a picture of a result."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars, say
from omomo_core.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import UInt8

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

    The ending of the output file decides: .mp4, .webp (a small loop for a web page), or .png with --still.

    Example: `omocap render chair_motion --size 1920x1080 -o chair.mp4`
    """
    width, height = given.picture_size(size, "--size")
    from capture_app.result import body_of, load_result
    from render.stills import write_png
    from render.third_person import frames

    loaded = load_result(result)
    index = _sample(loaded, sample)
    count = len(loaded.object_motion.valid)
    frame = None if still is None else _frame(still, count)
    target = file or result / _default_name(index, frame)
    _check_target(target, ".png" if still is not None else (".mp4", ".webp"))
    order = _order(frame, count, target)
    pictures = frames(
        loaded.motions[index],
        loaded.object_motion,
        body_of(loaded),
        width=width,
        height=height,
        markers=markers,
        backend=backend.value,
        only=order,
    )
    with progress_bars() as progress:
        told = (progress("video", (k + 1) / len(order)) or p for k, p in enumerate(pictures))
        if frame is not None:
            write_png(target, next(told))
        else:
            _write_moving(target, told)
    say("Done", str(target), "green")


def _order(frame: int | None, count: int, target: Path) -> Sequence[int]:
    """The frames to draw; an animation for a web page has half as many a second as a video."""
    if frame is not None:
        return [frame]
    return range(0, count, 2 if target.suffix == ".webp" else 1)


def _write_moving(target: Path, pictures: "Iterable[UInt8[np.ndarray, 'h w 3']]") -> None:
    from omomo_core.motion import FPS
    from render.video import write_video, write_webp

    if target.suffix == ".webp":
        write_webp(target, pictures, FPS / 2)
    else:
        write_video(target, pictures, FPS)


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


def _check_target(file: Path, endings: str | tuple[str, ...]) -> None:
    if not file.name.endswith(endings):
        wanted = endings if isinstance(endings, str) else " or ".join(endings)
        raise InputError(
            "output-ending",
            f"This output file must end in {wanted}.",
            where=str(file),
            fix="Give another name with -o.",
        )
    if not file.parent.is_dir():
        raise InputError(
            "output-not-writable",
            "The folder for the output file does not exist.",
            where=str(file.parent),
            fix="Make it, or give another file with -o.",
        )
