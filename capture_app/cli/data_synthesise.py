"""`omocap data synthesise`: recorded motion becomes a data set of people who move things."""

from collections import Counter
from collections.abc import Callable, Generator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from capture_app.cli.console import errors, output, say

if TYPE_CHECKING:
    from omomo_core.body.model import BodyModel
    from omomo_core.learning.recordings.clips import Clip
    from omomo_core.learning.recordings.dataset import Summary


Mocap = Annotated[
    Path,
    typer.Argument(help="Folder of recordings, or clips that `omocap data build` made of it."),
]
Out = Annotated[
    Path, typer.Option("-o", "--out", help="Folder of the data set; given again, it goes on.")
]
Count = Annotated[int, typer.Option(help="Clips to make, of 4 to 10 s each.", min=1)]
Seed = Annotated[int, typer.Option(help="The same seed makes the same clips.", min=0)]
ShareAlike = Annotated[
    bool, typer.Option(help="Use share-alike sources (HDM05); weights inherit the licence.")
]
Furniture = Annotated[
    Path | None,
    typer.Option(help="Folder of .obj furniture to handle, too (docs/data.md)."),
]
People = Annotated[str, typer.Option(help="Who of sub1 to sub17 acts; the paper learns from 1-15.")]
Objects = Annotated[
    str,
    typer.Option(help="all, the paper's ten seen or five unseen, or names: monitor,mop."),
]


def synthesise(
    mocap: Mocap,
    out: Out,
    count: Count = 4000,
    seed: Seed = 0,
    workers: Annotated[int, typer.Option(help="Processes to use.", min=1)] = 1,
    share_alike: ShareAlike = True,
    furniture: Furniture = None,
    people: People = "1-17",
    objects: Objects = "all",
) -> None:
    """Make clips of people who carry, push, pull, lift and turn things, out of recorded motion.

    Interrupt it when you like: the same command goes on with the files that are missing. A larger
    --count adds clips. What could not be held, or went wrong otherwise, is counted by reason.
    """
    from omomo_core.body.load import load_body
    from omomo_core.learning.recordings import dataset
    from omomo_core.learning.synthesis.engine import RECIPE
    from omomo_core.learning.synthesis.engine import synthesise as make
    from omomo_core.learning.synthesis.props import Furniture
    from omomo_core.learning.synthesis.roster import Roster, classes_of, people_of

    # Before the recordings are read, which may take minutes.
    roster = Roster(people_of(people), classes_of(objects))
    meshes = Furniture(furniture, roster.classes).digest if furniture is not None else None
    body, rejected = load_body(), Counter[str]()
    recorded = _recorded(mocap, body, share_alike=share_alike)
    recipe = dataset.DatasetRecipe(
        seed, RECIPE, dataset.digest(recorded), meshes,
        people=roster.people_text, objects=roster.objects_text,
    )  # fmt: skip
    dataset.open_dataset(out, recipe, recorded)
    indices = dataset.missing_indices(out, count)
    try:
        with _progress(len(indices), count) as progress:
            clips = make(
                recorded, body, count, seed, progress,
                workers=workers, rejected=rejected, indices=indices, furniture=furniture,
                roster=roster,
            )  # fmt: skip
            with closing(clips):
                for _ in dataset.write_shards(out, indices, clips, rejected):
                    pass
    except KeyboardInterrupt:
        kept = dataset.write_card(out, recipe).clips
        said = f"{kept} of {count} clips are in {out}; the same command goes on from there."
        errors.print(said, soft_wrap=True, markup=False)
        raise
    _show(dataset.write_card(out, recipe))
    say("Done", f"{count} clips in {out}", "green")


def _recorded(mocap: Path, body: "BodyModel", *, share_alike: bool) -> "list[Clip]":
    """Clips without objects, from a file, a data set or a folder of recordings."""
    from omomo_core.learning.recordings.build import build_mocap
    from omomo_core.learning.recordings.clips import load_clips
    from omomo_core.learning.recordings.dataset import RECORDED

    if mocap.is_dir() and not (mocap / RECORDED).is_file():
        dropped = Counter[str]()
        clips = build_mocap(mocap, body, share_alike=share_alike, dropped=dropped)
        for reason, number in dropped.most_common():
            say("left out", f"{number} x {reason}", "yellow")
        return clips
    clips = load_clips(mocap / RECORDED if mocap.is_dir() else mocap)
    return [
        clip
        for clip in clips
        if clip.object_motion is None and (share_alike or "BY-SA" not in clip.licence)
    ]


@contextmanager
def _progress(missing: int, count: int) -> Generator[Callable[[int, int], None]]:
    """A bar with clips a minute and the time left."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Left

    columns = (
        TextColumn("synthesise"), BarColumn(), MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.1f} clips/min, left"), Left(),
    )  # fmt: skip
    with Progress(*columns, console=errors, disable=not errors.is_terminal) as bar:
        task = bar.add_task("", total=count, completed=count - missing, rate=0.0)

        def advance(done: int, _: int) -> None:
            minutes = (bar.tasks[0].elapsed or 0.0) / 60.0
            bar.update(task, completed=count - missing + done, rate=done / max(minutes, 1e-6))

        yield advance


def _show(summary: "Summary") -> None:
    attempts = summary.clips + summary.rejected.total()
    output.print(
        f"{summary.clips} clips of {attempts} attempts, {summary.per_minute:.1f} sequences a minute"
    )
    for title, place in (("action", 0), ("object", 1)):
        minutes: dict[str, float] = {}
        for key, amount in summary.minutes.items():
            minutes[key[place]] = minutes.get(key[place], 0.0) + amount
        table = Table(title, "minutes", box=None, pad_edge=False, header_style="dim")
        for name, amount in sorted(minutes.items(), key=lambda item: -item[1]):
            table.add_row(name, f"{amount:.1f}")
        output.print(table)
    table = Table("rejected because", "attempts", "share", box=None, pad_edge=False)
    for reason, number in summary.rejected.most_common():
        table.add_row(reason, str(number), f"{100 * number / attempts:.0f} %")
    output.print(table)
