"""Several motions into one video or picture: what `omocap compare` does."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from capture_app.comparison.arrange import Comparison, compared
from capture_app.comparison.choice import choice
from capture_app.comparison.load import load_motions
from capture_app.comparison.save import save_figures
from capture_app.pictures import MOVING, frame_at, save_pictures, stride, told
from capture_app.progress import Progress, silent
from omomo_core.errors import InputError
from omomo_core.whole_file import check_target
from render.backends import Backend
from render.comparison import clock
from render.comparison_plate import PlateStyle, comparison_frames, comparison_sheet

MOST = 25
"""Motions that still fit on a screen."""


@dataclass(frozen=True)
class CompareRequest:
    """Which motions to compare, and how."""

    motions: Sequence[str]
    """As `capture_app.comparison.choice` reads them."""
    output: Path
    """.mp4, .webp or .gif; .png with `still` or `sheet`."""
    samples: bool = False
    """All samples of each result."""
    paper_rule: bool = False
    """After each result, the same person with contacts by the paper's rule."""
    heat: bool = False
    any_object: bool = False
    labels: Sequence[str] = ()
    """One for each motion, or none."""
    size: tuple[int, int] = (480, 360)
    """Of each motion's picture, pixels."""
    columns: int | None = None
    still: float | None = None
    """One picture, at this time in seconds."""
    sheet: int | None = None
    """So many moments of each motion in a row."""
    figures: Path | None = None
    """A JSON file for every figure."""
    markers: bool = True
    smooth: bool | None = None
    """Smooth edges; None: of pictures, not of videos."""
    backend: Backend = "auto"

    @property
    def picture(self) -> bool:
        """One file of PNG."""
        return self.still is not None or self.sheet is not None

    @property
    def style(self) -> PlateStyle:
        """How it is drawn."""
        smooth = self.picture if self.smooth is None else self.smooth
        return PlateStyle(
            *self.size, self.columns, self.heat, self.markers, self.backend, 4 if smooth else 0
        )


def compare_motions(request: CompareRequest, progress: Progress = silent) -> Comparison:
    """Read, align, measure and draw; each file appears whole or not at all.

    Args:
        request: what to compare.
        progress: told the stages "read" and "video".

    Raises:
        InputError: a motion cannot be read, they do not fit each other, or a file cannot be written.
    """
    check_target(request.output, (".png",) if request.picture else MOVING)
    if request.figures is not None:
        check_target(request.figures, (".json",))
    progress("read", 0.0)
    made = _read(request, progress)
    _draw(made, request, progress)
    if request.figures is not None:
        save_figures(request.figures, made)
    return made


def _read(request: CompareRequest, progress: Progress) -> Comparison:
    chosen = [choice(text) for text in request.motions]
    found = load_motions(chosen, all_samples=request.samples, paper_rule=request.paper_rule)
    if len(found) > MOST:
        raise InputError(
            "too-many-motions",
            f"{len(found)} motions do not fit beside each other.",
            fix=f"Name at most {MOST}, e.g. RESULT#1 RESULT#2.",
        )
    if request.labels and len(request.labels) != len(found):
        raise InputError(
            "labels-differ",
            f"There are {len(request.labels)} labels for {len(found)} motions.",
            where="--label",
            fix="Give --label once for each motion, or not at all.",
        )
    labels = request.labels or [motion.label for motion in found]
    named = [replace(m, label=label) for m, label in zip(found, labels, strict=True)]
    any_object = request.any_object
    return compared(named, any_object=any_object, progress=lambda done: progress("read", done))


def _draw(made: Comparison, request: CompareRequest, progress: Progress) -> None:
    count = clock(made.contenders)
    if request.sheet is not None:
        page = comparison_sheet(made.contenders, request.style, request.sheet)
        return save_pictures(request.output, iter([page]))
    step = stride(request.output)
    ticks = range(0, count, step) if request.still is None else [frame_at(request.still, count)]
    pictures = comparison_frames(made.contenders, request.style, ticks)
    return save_pictures(request.output, told(pictures, len(ticks), progress))
