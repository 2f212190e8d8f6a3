"""`omocap tables`: the paper's tables from our own code."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli import options as given
from capture_app.cli.console import errors, output, say

if TYPE_CHECKING:
    from capture_app.tables.run import TablesRun
    from capture_app.tables.sheet import Sheet


class FirstFrame(StrEnum):
    """Whether methods are told how the person stands in the first frame."""

    both = "both"
    given = "given"
    none = "none"


class SamplerName(StrEnum):
    """How a diffusion network is sampled."""

    fast = "dpm++"
    ddim = "ddim"
    ddpm = "ddpm"


class SplitName(StrEnum):
    """A side of the paper's split."""

    seen = "seen"
    unseen = "unseen"
    train = "train"


_ASKED = {FirstFrame.both: (True, False), FirstFrame.given: (True,), FirstFrame.none: (False,)}


Clips = Annotated[
    list[Path],
    typer.Argument(
        help="Recorded clips, data sets of `omocap data synthesise`, or files of the OMOMO "
        "release; docs/evaluation.md describes them.",
        show_default=False,
    ),
]
Weights = Annotated[
    Path | None,
    typer.Option(
        help="Folder with a folder of networks for each method: omomo, single-stage, goal, "
        "capture (the one that ships, if it is not there).",
        show_default=False,
    ),
]
Out = Annotated[Path, typer.Option("-o", "--out", help="Folder to make; given again, it goes on.")]
Samples = Annotated[int, typer.Option(help="K: people generated for each window.", min=1, max=200)]
Split = Annotated[
    SplitName | None,
    typer.Option(
        help="Only clips of this side: people 16 and 17 with the ten objects (seen) or the "
        "five (unseen), or the people and objects that were learnt from (train).",
        show_default=False,
    ),
]
Sampler = Annotated[SamplerName, typer.Option(help="The paper's is ddpm, of 1,000 steps.")]
Methods = Annotated[
    list[str] | None,
    typer.Option(
        help="Only these: goal, single-stage, no-constraints, omomo, gt-hands, capture, "
        "recorded; with commas, or given several times.",
        show_default=False,
    ),
]
Limit = Annotated[
    int | None,
    typer.Option(help="Windows of each table at most, spread evenly.", min=1, show_default=False),
]
FirstFrameGiven = Annotated[
    FirstFrame,
    typer.Option(help="With the person's first pose given, as in the paper, without, or both."),
]


def tables(
    clips: Clips,
    weights: Weights = None,
    out: Out = Path("tables"),
    samples: Samples = 20,
    seed: given.Seed = 0,
    split: Split = None,
    sampler: Sampler = SamplerName.fast,
    steps: given.Steps = 10,
    methods: Methods = None,
    limit: Limit = None,
    workers: Annotated[int, typer.Option(help="Processes to use.", min=1)] = 1,
    first_frame: FirstFrameGiven = FirstFrame.both,
) -> None:
    """Run methods over recorded clips and print the paper's tables 2, 3 and 4.

    Clips are cut into windows of four seconds. The paper's own numbers stand beneath ours; they are
    of its own data. Interrupt it when you like: the same command goes on.

    Example: `omocap tables test_clips --weights weights --out tables --workers 2`
    """
    from capture_app.tables.run import TablesRequest, make_tables

    request = TablesRequest(
        clips,
        out,
        weights,
        samples=samples,
        seed=seed,
        sampler=sampler.value,
        steps=steps,
        methods=[name for given in methods or [] for name in given.split(",")],
        first_frame=_ASKED[first_frame],
        split=split.value if split else "",
        limit=limit,
        workers=workers,
    )
    try:
        with _bar() as progress:
            made = make_tables(request, progress)
    except KeyboardInterrupt:
        said = f"The answers so far are in {out}; the same command goes on from there."
        errors.print(said, soft_wrap=True, markup=False)
        raise
    _show(made)


@contextmanager
def _bar() -> Generator[Callable[[int, int], None]]:
    """Answers, and the time left."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Left

    columns = (TextColumn("Asking"), BarColumn(), MofNCompleteColumn(), TextColumn("left"), Left())
    with Progress(*columns, console=errors, disable=not errors.is_terminal) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _show(made: "TablesRun") -> None:
    from capture_app.tables.caption import caption
    from capture_app.tables.sheet import sheets_of

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
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    output.print(sheet.title, style="bold", markup=False)
    for heading, rows in sheet.sections():
        table = Table(title=Text(heading), title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
        table.add_column(no_wrap=True)
        for column in sheet.columns:
            table.add_column(Text(column.title), justify="right")
        for row in rows:
            table.add_row(Text(row.label), *row.cells, style="dim italic" if row.published else "")
        output.print(table)
