"""Several motions into one video or picture: what `omocap compare` does."""

import json
from dataclasses import replace
from pathlib import Path

from capture_app.commands.render import CompareRequest
from capture_app.commands.spelling import all_in_options
from capture_app.comparison.arrange import Comparison, compared
from capture_app.comparison.compared_motions import choice, load_motions
from capture_app.progress import Progress, silent
from capture_app.rendering import MOVING, frame_at, save_pictures, stride, with_progress
from omomo_core.errors import InputError
from omomo_core.motion import FPS
from omomo_core.whole_file import check_target, write_whole
from render.comparison import clock
from render.comparison_plate import PlateStyle, comparison_frames, comparison_sheet


def save_figures(path: Path, made: Comparison) -> None:
    """Write every figure and note as JSON.

    Raises:
        InputError: the file cannot be written.
    """
    rows = [
        {
            "label": c.label,
            "truth": c.truth,
            "begins_s": c.begin / FPS,
            "lasts_s": len(c.human.root) / FPS,
            "figures": figures,
        }
        for c, figures in zip(made.contenders, made.figures, strict=True)
    ]
    text = json.dumps({"motions": rows, "notes": all_in_options(made.notes)}, indent=1) + "\n"
    write_whole(path, text)


MOST = 25
"""Motions that still fit on a screen."""


def compare_motions(request: CompareRequest, progress: Progress = silent) -> Comparison:
    """Read, align, measure and draw; each file appears whole or not at all.

    Args:
        request: what to compare.
        progress: called with the stages "read" and "video".

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
    found = load_motions(
        chosen,
        all_samples=request.samples,
        paper_rule=request.rule == "paper",
        progress=progress,
    )
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
            field="label",
            fix="Give ‹label› once for each motion, or not at all.",
        )
    labels = request.labels or [motion.label for motion in found]
    named = [replace(m, label=label) for m, label in zip(found, labels, strict=True)]
    any_object = request.any_object
    return compared(named, any_object=any_object, progress=lambda done: progress("read", done))


def _draw(made: Comparison, request: CompareRequest, progress: Progress) -> None:
    count, style = clock(made.contenders), _style(request)
    if request.sheet is not None:
        page = comparison_sheet(made.contenders, style, request.sheet)
        return save_pictures(request.output, iter([page]))
    step = stride(request.output)
    ticks = range(0, count, step) if request.still is None else [frame_at(request.still, count)]
    pictures = comparison_frames(made.contenders, style, ticks)
    return save_pictures(request.output, with_progress(pictures, len(ticks), progress))


def _style(request: CompareRequest) -> PlateStyle:
    smooth = request.picture if request.smooth is None else request.smooth
    samples = 4 if smooth else 0
    return PlateStyle(
        *request.size, request.columns, request.heat, request.markers, request.backend, samples
    )
