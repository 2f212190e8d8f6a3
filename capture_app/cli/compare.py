"""`omocap compare`: several motions side by side, on one clock and from one camera."""

from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli import options as given
from capture_app.cli.console import output as console
from capture_app.cli.console import progress_bars, say
from omomo_core.errors import InputError
from omomo_core.whole_file import check_target

if TYPE_CHECKING:
    from capture_app.comparison.arrange import Comparison
    from render.comparison_plate import PlateStyle
    from render.strips import Picture

Told = Callable[[float], None]
"""Told how far something is, 0 to 1."""

MOST = 25
"""Motions that still fit on a screen."""


class Rule(StrEnum):
    """By which else the contacts are decided."""

    paper = "paper"


Motions = Annotated[
    list[str],
    typer.Argument(
        help="Result folders, RESULT#3 for the third sample, recorded clips (npz as `omocap "
        "evaluate` reads them), or CLIPS#name of a file of training clips.",
        show_default=False,
    ),
]
File = Annotated[
    Path, typer.Option("-o", "--output", help="File to write: .mp4, .webp, .gif or .png.")
]
AllSamples = Annotated[bool, typer.Option("--samples", help="All samples of each result.")]
PaperRule = Annotated[
    Rule | None,
    typer.Option(
        help="After each result, the same person with contacts by the paper's rule.",
        show_default=False,
    ),
]
Heat = Annotated[
    bool, typer.Option("--heat", help="Colour bodies by their distance from the first one.")
]
AnyObject = Annotated[bool, typer.Option("--any", help="Allow motions of different objects.")]
Labels = Annotated[
    list[str] | None,
    typer.Option(help="What to write above each motion, in order; once for each."),
]
Size = Annotated[str, typer.Option(help="Width x height of each motion's picture in pixels.")]
Columns = Annotated[
    int | None,
    typer.Option(help="Motions side by side; 1 stacks them.", min=1, show_default=False),
]
Sheet = Annotated[
    int | None,
    typer.Option(
        help="One PNG with so many moments of each motion in a row.",
        min=1,
        max=24,
        show_default=False,
    ),
]
Figures = Annotated[Path | None, typer.Option("--json", help="File to write every figure to.")]


def compare(
    motions: Motions,
    file: File = Path("compare.mp4"),
    samples: AllSamples = False,
    rule: PaperRule = None,
    heat: Heat = False,
    any_object: AnyObject = False,
    label: Labels = None,
    size: Size = "480x360",
    columns: Columns = None,
    still: given.Still = None,
    sheet: Sheet = None,
    json_file: Figures = None,
    markers: given.Markers = True,
    smooth: given.Smooth = None,
    backend: given.Backend = given.DrawingBackend.auto,
) -> None:
    """Show motions side by side, with their contacts and what can be measured of them.

    A recorded clip among them is the truth: its contacts stand above those of the others, and
    distances from it are measured.

    Example: `omocap compare chair_motion other_motion -o compare.mp4`
    """
    width, height = given.picture_size(size, "--size")
    picture = still is not None or sheet is not None
    check_target(file, (".png",) if picture else (".mp4", ".webp", ".gif"))
    if json_file is not None:
        check_target(json_file, (".json",))
    from render.comparison_plate import PlateStyle

    edges = 4 if (picture if smooth is None else smooth) else 0
    with progress_bars() as progress:
        progress("read", 0.0)
        made = _made(motions, samples, rule, label or [], any_object, lambda x: progress("read", x))
        style = PlateStyle(width, height, columns, heat, markers, backend.value, samples=edges)
        _save(made, style, file, still, sheet, lambda x: progress("video", x))
    _tell(made)
    if json_file is not None:
        from capture_app.comparison.save import save_figures

        save_figures(json_file, made)
    say("Done", str(file), "green")


def _made(
    motions: Sequence[str],
    samples: bool,
    rule: Rule | None,
    labels: Sequence[str],
    any_object: bool,
    progress: Told,
) -> "Comparison":
    """The motions, read, aligned and measured."""
    from dataclasses import replace

    from capture_app.comparison.arrange import compared
    from capture_app.comparison.choice import choice
    from capture_app.comparison.load import load_motions

    chosen = [choice(text) for text in motions]
    found = load_motions(chosen, all_samples=samples, paper_rule=rule is Rule.paper)
    if len(found) > MOST:
        raise InputError(
            "too-many-motions",
            f"{len(found)} motions do not fit beside each other.",
            fix=f"Name at most {MOST}, e.g. RESULT#1 RESULT#2.",
        )
    if labels and len(labels) != len(found):
        raise InputError(
            "labels-differ",
            f"There are {len(labels)} labels for {len(found)} motions.",
            where="--label",
            fix="Give --label once for each motion, or not at all.",
        )
    named = zip(found, labels or [m.label for m in found], strict=True)
    return compared(
        [replace(m, label=name) for m, name in named], any_object=any_object, progress=progress
    )


def _save(
    made: "Comparison",
    style: "PlateStyle",
    file: Path,
    still: float | None,
    sheet: int | None,
    progress: Told,
) -> None:
    from capture_app.comparison.save import save_pictures, stride
    from render.comparison import clock
    from render.comparison_plate import comparison_frames, comparison_sheet

    count = clock(made.contenders)
    if sheet is not None:
        return save_pictures(file, iter([comparison_sheet(made.contenders, style, sheet)]))
    ticks = range(0, count, stride(file)) if still is None else [_tick(still, count)]
    pictures = comparison_frames(made.contenders, style, ticks)
    return save_pictures(file, _told(pictures, len(ticks), progress))


def _told(pictures: "Iterator[Picture]", count: int, progress: Told) -> "Iterator[Picture]":
    for k, picture in enumerate(pictures):
        yield picture
        progress((k + 1) / count)


def _tick(seconds: float, count: int) -> int:
    tick = round(seconds * 30)
    if not 0 <= tick < count:
        raise InputError(
            "time-outside",
            f"There is no picture at {seconds:g} s: the comparison lasts {count / 30:.2f} s.",
            where="--still",
            fix="Give a time within it.",
        )
    return tick


def _tell(made: "Comparison") -> None:
    from rich.table import Table
    from rich.text import Text

    for note in made.notes:
        say("note", note, "yellow")
    table = Table("")
    names = dict.fromkeys(n.name for c in made.contenders for n in c.numbers)
    for contender in made.contenders:
        table.add_column(Text(contender.label), justify="right", overflow="fold")
    for name in names:
        cells = [{n.name: n for n in c.numbers}.get(name) for c in made.contenders]
        table.add_row(
            name, *(f"[green]{n.value}[/]" if n and n.best else n.value if n else "" for n in cells)
        )
    console.print(table)
