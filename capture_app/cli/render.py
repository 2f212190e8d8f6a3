"""`omocap render`: draw the video or a picture of a result."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars, say
from omomo_core.errors import InputError
from omomo_core.whole_file import check_target

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import UInt8


_SMALL = (".webp", ".gif")


def render(
    result: given.Result,
    file: given.OutputFile = None,
    view: given.View = given.SeenFrom.third,
    sample: given.Sample = None,
    size: given.Size = "960x540",
    still: given.Still = None,
    sheet: given.Sheet = None,
    markers: given.Markers = True,
    smooth: given.Smooth = None,
    backend: given.Backend = given.DrawingBackend.auto,
) -> None:
    """Draw a result again: from elsewhere, another size, another sample, or as pictures.

    The ending of the output file decides: .mp4, .webp or .gif (a small loop for a web page), or .png
    with --still or --sheet.

    Example: `omocap render chair_motion --view orbit --size 1920x1080 -o chair.mp4`
    """
    width, height = given.picture_size(size, "--size")
    columns, rows = given.sheet_size(sheet, "--sheet") if sheet else (1, 1)
    from capture_app.overlay.eye import eye_of
    from capture_app.result import body_of, load_result, sample_index
    from render.contact_points import held_places
    from render.third_person import frames
    from render.views import shot

    loaded = load_result(result)
    index = sample_index(loaded, sample)
    still_given = still is not None or sheet is not None
    target = file or result / _default_name(index, view, still, sheet)
    check_target(target, (".png",) if still_given else (".mp4", *_SMALL))
    order = _order(
        still, columns * rows if sheet else None, len(loaded.object_motion.valid), target
    )
    person, moved = loaded.people[index], loaded.object_motion
    eye = eye_of(loaded) if view == given.SeenFrom.object else None
    seen = shot(view.value, person.human, moved, width, height, eye)
    pictures = frames(
        person.human,
        moved,
        body_of(loaded),
        width=width,
        height=height,
        cameras=seen.cameras,
        markers=markers,
        extra=[*(held_places(person.segments, moved) if markers else ()), *seen.tracks],
        pixels_per_metre=seen.pixels_per_metre,
        samples=4 if (still_given if smooth is None else smooth) else 0,
        backend=backend.value,
        only=order,
    )
    with progress_bars() as progress:
        told = (progress("video", (k + 1) / len(order)) or p for k, p in enumerate(pictures))
        _write(target, told, columns)
    say("Done", str(target), "green")


def _write(target: Path, pictures: "Iterable[UInt8[np.ndarray, 'h w 3']]", columns: int) -> None:
    """Write what the ending of the file says."""
    if target.suffix == ".png":
        from render.stills import contact_sheet, write_png

        write_png(target, contact_sheet(list(pictures), columns))
    else:
        from omomo_core.motion import FPS
        from render.video import write_moving

        write_moving(target, pictures, FPS / 2 if target.suffix in _SMALL else FPS)


def _order(still: float | None, pictures: int | None, count: int, target: Path) -> Sequence[int]:
    """The frames to draw; an animation for a web page has half as many a second as a video."""
    if still is not None and pictures:
        raise InputError(
            "sheet-and-still",
            "One picture and a sheet of them cannot be one file.",
            where="--still, --sheet",
            fix="Give one of the two.",
        )
    if still is not None:
        return [_frame(still, count)]
    if pictures:
        return [round(k * (count - 1) / max(pictures - 1, 1)) for k in range(pictures)]
    return range(0, count, 2 if target.suffix in _SMALL else 1)


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


def _default_name(sample: int, view: given.SeenFrom, still: float | None, sheet: str | None) -> str:
    words = [f"sample_{sample + 1}"]
    if view != given.SeenFrom.third:
        words.append(view.value)
    if still is not None:
        words.append(f"{round(still * 30):05d}")
    if sheet:
        words.append("sheet")
    return "_".join(words) + (".png" if still is not None or sheet else ".mp4")
