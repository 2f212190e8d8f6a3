"""`omocap batch`: many sessions become motions."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from capture_app.cli import options
from capture_app.cli.console import ProgressBars, errors, in_options, say
from capture_app.cli.console import output as console
from capture_app.cli.derived import derived
from capture_app.commands.inputs import OptionGroup
from capture_app.commands.run import RunRequest
from capture_app.jobs.batch_watch import Shown
from capture_app.jobs.job_record import JobRecord
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from capture_app.jobs.fleet import Fleet
    from capture_app.jobs.queue import JobQueue


_MOST = 12
"""Sessions shown at once."""


@contextmanager
def batch_bars(total: int) -> Generator[Shown]:
    """Gives what `watch` calls; each job that ends has a line, whether on a terminal or not."""
    columns = (
        TextColumn("{task.description:<30.30}"),
        BarColumn(),
        TextColumn("{task.fields[at]}"),
    )
    bars: dict[str, TaskID] = {}
    with ProgressBars(*columns) as progress:
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


Sessions = Annotated[
    Path,
    typer.Argument(
        help="Folder of sessions (folders and archives), or a CSV table with the column `session` "
        "and, where lines differ, `object`, `mount`, `name`, `height`, `floor`, ...",
        show_default=False,
    ),
]
Results = Annotated[
    Path,
    typer.Option(
        "-o", "--output", help="Folder for the results and their table.", show_default=False
    ),
]
Database = Annotated[
    str | None,
    typer.Option(
        "--database",
        envvar="OMOCAP_DATABASE",
        help="Queue that other machines work for, postgresql://user@host/name; a file in the output "
        "folder if not given.",
        show_default=False,
        rich_help_panel=OptionGroup.MACHINES,
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        help="Sessions at once on this machine; 1, or none where --database has workers.",
        min=0,
        show_default=False,
        rich_help_panel=OptionGroup.MACHINES,
    ),
]


@derived(
    RunRequest,
    first=("object", "mount"),
    leave_out=("session", "node", "contacts", "segment"),
)
def batch(
    sessions: Sessions,
    output: Results,
    database: Database = None,
    workers: Workers = None,
    video: options.Video = True,
    **said: Any,
) -> None:
    """Make the motions of all sessions in a folder or table; a bad session does not stop the others.

    Writes a result folder for each, *results.csv* and *results.json*. Ctrl-C and the same command
    again goes on where it was; what failed is tried again.

    Example: `omocap batch takes --object chair.obj --mount chair_mount.json -o motions --workers 2`
    """
    said["mount"] = said["mount"] and str(said["mount"])
    said["weights"] = said["weights"] and said["weights"].absolute()
    if not video:
        said["video_size"] = None
    _run(sessions, output, said, database, workers)


def _run(
    sessions: Path, result: Path, said: dict[str, Any], database: str | None, workers: int | None
) -> None:
    """Order it all, have it done, and tell what came out."""
    from capture_app.jobs.batch import order_of, submit_batch
    from capture_app.jobs.fleet import Fleet
    from capture_app.jobs.queue import open_queue

    rows = _rows(sessions)
    orders = [order_of({**said, **row}, result.absolute()) for row in rows]
    _make_folder(result)
    queue = open_queue(database or str(result / "jobs.sqlite"))
    count = (0 if database else 1) if workers is None else workers
    ids, notes = submit_batch(queue, orders)
    for note in notes:
        say("Note", note, "yellow")
    log = result / "workers.log"
    fleet = Fleet(queue.database_url, count, log=log, died=queue.worker_died)
    fleet.start()
    try:
        if not count and not queue.workers():
            say("Note", "no worker is there yet: `omocap worker` makes a machine one.", "yellow")
        _watch(queue, ids, fleet)
    except BaseException:
        with suppress(InputError):  # there may be no room for the table either
            _end(queue, ids, fleet, result)
        raise
    _tell(result, _end(queue, ids, fleet, result))


def _end(queue: "JobQueue", ids: Sequence[str], fleet: "Fleet", result: Path) -> list[JobRecord]:
    """Stop the workers and write the tables; returns what became of the jobs."""
    from capture_app.jobs.batch import write_results
    from capture_app.jobs.batch_watch import videos_of

    fleet.stop()
    jobs = queue.get_all(ids)
    videos = queue.get_all(videos_of(jobs))
    queue.close()
    write_results(result, jobs)
    for video in videos:
        if video.state == "failed" and video.error:
            say("Note", f"{video.name} could not be drawn: {video.error.what}", "yellow")
    return jobs


def _rows(sessions: Path) -> "list[dict[str, Any]]":
    from capture_app.jobs.batch import find_sessions, read_table

    if sessions.suffix.lower() == ".csv" and sessions.is_file():
        return read_table(sessions)
    logs = find_sessions(sessions)
    return [{"name": name, "session": path} for name, path in logs.items()]


def _make_folder(result: Path) -> None:
    try:
        result.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            "output-not-writable",
            f"The output folder cannot be made: {error.strerror or error}.",
            where=str(result),
            fix="Give a folder you may write to with -o.",
        ) from error


def _watch(queue: "JobQueue", ids: Sequence[str], fleet: "Fleet") -> None:
    from capture_app.jobs.batch_watch import watch

    with batch_bars(len(ids)) as show:
        watch(queue, ids, show, full=lambda: fleet.full)


def _tell(result: Path, jobs: Sequence[JobRecord]) -> None:
    from rich.table import Table
    from rich.text import Text

    failed = [job for job in jobs if job.state != "done"]
    if failed:
        table = Table("session", "what is wrong", box=None, header_style="dim")
        for job in failed:
            table.add_row(
                Text(job.name), Text(in_options(job.error.what) if job.error else job.state)
            )
        console.print(table)
        say("Note", "what to do about these stands in the table of results.", "yellow")
    say("Done", f"{len(jobs) - len(failed)} of {len(jobs)}: {result / 'results.csv'}", "green")
    if failed:
        raise typer.Exit(2)
