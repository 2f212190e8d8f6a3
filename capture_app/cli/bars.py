"""Progress of long work on stderr: bars on a terminal, one line a minute in a log."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from capture_app.cli.console import errors

SECONDS_PER_LINE = 60.0
"""Time from one line of a log to the next."""


class ProgressBars(Progress):
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
        """What stands beside the bar of a task."""
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
def following(label: str) -> Generator[Callable[[str, float], None]]:
    """Show what is being worked on; gives what is called with (its name, fraction of all done)."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with ProgressBars(*columns) as bars:
        task = bars.add_task(label, total=1.0)

        def show(name: str, fraction: float) -> None:
            bars.update(task, description=f"{label} {name}", completed=fraction)

        yield show
