"""How far a batch is: a bar for all of it, and one for each session at work."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager

from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from capture_app.cli.console import errors
from capture_app.jobs.batch.watch import Shown
from capture_app.jobs.record import JobRecord

_MOST = 12
"""Sessions shown at once."""


@contextmanager
def batch_bars(total: int) -> Generator[Shown]:
    """Gives what `watch` tells; without a terminal there is a line for each job that ends."""
    columns = (
        TextColumn("{task.description:<30.30}"),
        BarColumn(),
        TextColumn("{task.fields[at]}"),
    )
    bars: dict[str, TaskID] = {}
    with Progress(*columns, console=errors, disable=not errors.is_terminal) as progress:
        whole = progress.add_task("All sessions", total=total, at=f"0 of {total}")
        over = 0

        def show(ended: Sequence[JobRecord], running: Sequence[JobRecord]) -> None:
            nonlocal over
            over += len(ended)
            progress.update(whole, completed=over, at=f"{over} of {total}")
            for job in ended:
                colour = "green" if job.state == "done" else "red"
                errors.print(f"[{colour}]{job.state:>9}[/] {escape(job.name)}")
            _show_running(progress, bars, running[:_MOST])

        yield show


def _show_running(
    progress: Progress, bars: dict[str, TaskID], running: Sequence[JobRecord]
) -> None:
    names = {job.id for job in running}
    for gone in [id for id in bars if id not in names]:
        progress.remove_task(bars.pop(gone))
    for job in running:
        if job.id not in bars:
            bars[job.id] = progress.add_task(f"  {escape(job.name)}", total=1.0, at="")
        progress.update(bars[job.id], completed=job.fraction, at=job.stage)
