"""`omocap compare`: several motions side by side, on one clock and from one camera."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from capture_app.cli.console import output as console
from capture_app.cli.console import progress_bars, say
from capture_app.cli.derived import derived
from capture_app.commands.render import CompareRequest
from capture_app.commands.request import validated

if TYPE_CHECKING:
    from capture_app.comparison.arrange import Comparison


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
Labels = Annotated[
    list[str] | None,
    typer.Option(help="What to write above each motion, in order; once for each."),
]


@derived(CompareRequest)
def compare(
    motions: Motions, output: File = Path("compare.mp4"), label: Labels = None, **said: Any
) -> None:
    """Show motions side by side, with their contacts and what can be measured of them.

    A recorded clip among them is the truth: its contacts stand above those of the others, and
    distances from it are measured.

    Example: `omocap compare chair_motion other_motion -o compare.mp4`
    """
    from capture_app.comparison.comparison_film import compare_motions

    said |= {"motions": motions, "output": output, "labels": label or ()}
    request = validated(CompareRequest, said, "option-invalid")
    with progress_bars() as progress:
        made = compare_motions(request, progress)
    _tell(made)
    say("Done", str(output), "green")


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
