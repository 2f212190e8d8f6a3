"""`omocap compare`: several motions side by side, on one clock and from one camera."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli import options as given
from capture_app.cli.console import output as console
from capture_app.cli.console import progress_bars, say
from capture_app.coordinates import read_size

if TYPE_CHECKING:
    from capture_app.comparison.arrange import Comparison


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
    pixels = read_size(size, "--size")
    from capture_app.comparison.film import CompareRequest, compare_motions

    request = CompareRequest(
        motions,
        file,
        samples=samples,
        paper_rule=rule is Rule.paper,
        heat=heat,
        any_object=any_object,
        labels=label or [],
        size=pixels,
        columns=columns,
        still=still,
        sheet=sheet,
        figures=json_file,
        markers=markers,
        smooth=smooth,
        backend=backend.value,
    )
    with progress_bars() as progress:
        made = compare_motions(request, progress)
    _tell(made)
    say("Done", str(file), "green")


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
