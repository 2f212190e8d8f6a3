"""`omocap tables`: the paper's tables from our own code."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from capture_app.cli.console import asking, output, say
from capture_app.cli.derived import derived
from capture_app.cli.figure_table import FigureRow, FigureTable
from capture_app.commands.request import validated
from capture_app.commands.tables import TablesRequest

if TYPE_CHECKING:
    from capture_app.tables.run_tables import TablesRun
    from capture_app.tables.table_files import Sheet


Clips = Annotated[
    list[Path],
    typer.Argument(
        help="Recorded clips, data sets of `omocap data synthesise`, or files of the OMOMO "
        "release; docs/evaluation.md describes them.",
        show_default=False,
    ),
]
Out = Annotated[Path, typer.Option("-o", "--out", help="Folder to make; given again, it goes on.")]


@derived(TablesRequest)
def tables(clips: Clips, out: Out = Path("tables"), **said: Any) -> None:
    """Run methods over recorded clips and print the paper's tables 2, 3 and 4.

    Clips are cut into windows of four seconds. The paper's own numbers stand beneath ours; they are
    of its own data. Interrupt it when you like: the same command goes on.

    Example: `omocap tables test_clips --weights weights --out tables --workers 2`
    """
    from capture_app.tables.run_tables import make_tables

    asked = {**said, "clips": clips, "output": out}
    request = validated(TablesRequest, asked, "option-invalid")
    with asking(out) as progress:
        made = make_tables(request, progress)
    _show(made)


def _show(made: "TablesRun") -> None:
    from capture_app.tables.table_files import caption, sheets_of

    for table in made.tables:
        for sheet in sheets_of(table):
            _print(sheet)
        for verdict in table.verdicts:
            output.print(f"- {verdict}", markup=False)
        output.print()
    for sentence in caption(made.made):
        output.print(sentence, markup=False)
    for file in made.files:
        say("Done", str(file), "green")


def _print(sheet: "Sheet") -> None:
    output.print(sheet.title, style="bold", markup=False)
    for heading, rows in sheet.sections():
        lines = [FigureRow([row.label], row.cells, dim=row.published) for row in rows]
        FigureTable(heading, [""], [column.title for column in sheet.columns], lines).print()
