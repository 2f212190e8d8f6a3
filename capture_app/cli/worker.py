"""`omocap worker`: join the workers of a queue, and stop as a process manager asks."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.console import say


@contextmanager
def until_stopped() -> Generator[Callable[[], object]]:
    """Gives a function that waits for SIGINT or SIGTERM, which meanwhile do nothing else."""
    stop = threading.Event()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stop.set()) for number in numbers]
    try:
        yield stop.wait
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


Database = Annotated[
    str,
    typer.Option(
        "--database",
        envvar="OMOCAP_DATABASE",
        help="postgresql://user@host/name, which many machines can reach, or the path of a SQLite "
        "file. A password is better kept in the environment variable or in ~/.pgpass.",
        show_default=False,
    ),
]
Jobs = Annotated[int, typer.Option(help="Jobs at once, each in a process of its own.", min=1)]
Log = Annotated[
    Path | None,
    typer.Option(help="File to append what happens to; printed if not given.", show_default=False),
]


def worker(database: Database, jobs: Jobs = 1, log: Log = None) -> None:
    """Join the workers of a queue: those of `omocap batch` or `omocap serve`, here or elsewhere.

    Ctrl-C or SIGTERM hands back what it is at; another worker goes on after the last finished stage.
    So it does, half a minute later at the latest, when a worker is killed or its machine dies.

    Example: `omocap worker --database postgresql://omocap@server/jobs --jobs 2`
    """
    from capture_app.jobs.fleet import Fleet
    from capture_app.jobs.queue import open_queue

    queue = open_queue(database)
    fleet = Fleet(queue.database_url, jobs, log=log, died=queue.worker_died)
    with until_stopped() as wait:
        say("Working for", queue.shown, "bold")
        fleet.start()
        wait()
        fleet.stop()
        queue.close()
