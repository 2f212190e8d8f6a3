"""The consoles of the command line and its bars of progress: results go to stdout, all else to stderr."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    ProgressColumn,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as RichProgress
from rich.text import Text

from capture_app.progress import Progress
from omomo_core.errors import OmocapError

output = Console(highlight=False)
errors = Console(stderr=True, highlight=False)

_STAGES = {
    "read": "Reading the take",
    "object": "Measuring the object",
    "hands": "Placing the hands",
    "contact": "Deciding what they hold",
    "body": "Moving the body",
    "solve": "Fitting the body",
    "export": "Writing the files",
    "episodes": "Making episodes",
    "video": "Drawing the video",
    "board": "Looking for the board",
    "look": "Looking for sharp pictures",
    "frames": "Picking pictures",
    "features": "Finding features",
    "compare": "Comparing pictures",
    "match": "Matching pictures",
    "cameras": "Placing the cameras",
    "stereo": "Measuring depth",
    "silhouettes": "Cutting out the object",
    "fusion": "Joining depth and outlines",
    "colours": "Colouring",
    "clean": "Cleaning the mesh",
    "texture": "Painting the texture",
    "report": "Writing the report",
}


def in_options(text: str) -> str:
    """Return a text with the command line's options in place of references such as ‹mesh_scale›."""
    if "‹" not in text:
        return text
    from capture_app.commands import spelling

    return spelling.in_options(text)


def say(label: str, text: str, style: str) -> None:
    """Print a result line that begins with a coloured word; the text is shown as it is."""
    output.print(Text.assemble((f"{label}: ", style), in_options(text)), soft_wrap=True)


def report(error: OmocapError) -> None:
    """Print what is wrong, where, how to fix it, and the code, as one paragraph."""
    text = Text.assemble(("Error: ", "bold red"), in_options(error.what))
    for label, value in (("where", error.where), ("fix", error.fix), ("code", error.code)):
        if value:
            text.append(f"\n  {label}: ", style="bold")
            text.append(in_options(value))
    errors.print(text, soft_wrap=True)


@contextmanager
def progress_bars() -> Generator[Progress]:
    """A bar for each stage that reports; a line a minute when stderr is not a terminal."""
    from rich.progress import BarColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:<18}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    tasks: dict[str, TaskID] = {}
    with ProgressBars(*columns) as bars:

        def advance(stage: str, fraction: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(_STAGES.get(stage, stage), total=1.0)
            bars.update(tasks[stage], completed=fraction)

        yield advance


SECONDS_PER_LINE = 60.0
"""Time from one line of a log to the next."""


class ProgressBars(RichProgress):
    """A bar for each task; where the console is no terminal, a line a minute says the same."""

    def __init__(self, *columns: ProgressColumn) -> None:
        """Show tasks in these columns; on a console of a log, those that are text."""
        super().__init__(*columns, console=errors, disable=not errors.is_terminal)
        self._next_line = self.get_time() + SECONDS_PER_LINE

    def update(self, task_id: TaskID, **changes: Any) -> None:
        """Change a task, as `rich.progress.Progress.update` does, and print a line if one is due."""
        super().update(task_id, **changes)
        if self.disable and self.get_time() >= self._next_line:
            self._next_line = self.get_time() + SECONDS_PER_LINE
            self.console.print(self._line(task_id), soft_wrap=True)

    def _line(self, task_id: TaskID) -> Text:
        """Return what stands beside the bar of a task."""
        task = next(task for task in self.tasks if task.id == task_id)
        cells = (column(task) for column in self.columns if isinstance(column, ProgressColumn))
        return Text(" ".join(cell.plain.strip() for cell in cells if isinstance(cell, Text)))


@contextmanager
def counting(label: str) -> Generator[Callable[[int, int], None]]:
    """Show how much is done of a number of things; gives what is called with (done, total)."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with ProgressBars(*columns) as bars:
        task = bars.add_task(label, total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


@contextmanager
def asking(kept: Path | None) -> Generator[Callable[[int, int], None]]:
    """Show how many answers there are, and say where they are kept when the command is interrupted."""
    try:
        with counting("Asking") as count:
            begun = False

            def show(done: int, total: int) -> None:
                nonlocal begun
                if done and not begun:
                    errors.print(f"{done} of {total} answers are there from an earlier run.")
                begun = True
                count(done, total)

            yield show
    except KeyboardInterrupt:
        if kept is not None:
            text = f"The answers so far are in {kept}; the same command goes on from there."
            errors.print(text, soft_wrap=True, markup=False)
        raise
