"""How many short jobs a second 1, 2 and 4 workers do, in SQLite and in PostgreSQL.

Usage: python -m benchmarks.fleet [--jobs 1000] [--seconds 0.1] [--busy] [--database URL]

Each job has three stages of equal length, which sleep, as if they waited for a graphics card, or with
--busy count on one core. Without --database it is SQLite in a temporary folder. The clock runs from
when all workers wait for jobs until the last job is done.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import ClassVar
from uuid import uuid4

from capture_app.commands.request import Request
from capture_app.jobs import __main__ as process
from capture_app.jobs.fleet import Fleet
from capture_app.jobs.job_kinds import Attempt, JobKind
from capture_app.jobs.job_record import OVER
from capture_app.jobs.queue import JobQueue, open_queue
from capture_app.jobs.worker import work

_STAGES = ("first", "second", "third")


class ShortOrder(Request):
    KIND: ClassVar[str] = "short"

    seconds: float
    busy: bool


class Short:
    """A job that makes nothing."""

    timings: Mapping[str, float] = {}

    def __init__(self, order: ShortOrder, attempt: Attempt) -> None:
        self._order, self._attempt = order, attempt

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        return {name: (lambda name=name: self._spend(name)) for name in _STAGES}

    def settle(self) -> None:
        pass

    def discard(self) -> None:
        pass

    def _spend(self, name: str) -> None:
        seconds = self._order.seconds / len(_STAGES)
        if self._order.busy:
            begin = time.thread_time()
            while time.thread_time() - begin < seconds:
                sum(range(1000))
        else:
            time.sleep(seconds)
        self._attempt.progress(name, 1.0)


_KIND = JobKind(ShortOrder, Short, dict.fromkeys(_STAGES, 1.0))


def measure(queue: JobQueue, folder: Path, workers: int, arguments: argparse.Namespace) -> float:
    """Jobs a second."""
    command = [sys.executable, "-m", "benchmarks.fleet", "--work"]
    fleet = Fleet(queue.database_url, workers, log=folder / "log", command=command)
    fleet.start()
    _wait(lambda: queue.workers(silence=3.0) >= workers)
    order = ShortOrder(output=folder, seconds=arguments.seconds, busy=arguments.busy)
    ids = [uuid4().hex[:16] for _ in range(arguments.jobs)]
    begin = time.perf_counter()
    queue.submit_all([(id, order) for id in ids])
    submitted = time.perf_counter() - begin
    _wait(lambda: all(job.state in OVER for job in queue.get_all(ids[-50:])))
    _wait(lambda: all(job.state in OVER for job in queue.get_all(ids)))
    seconds = time.perf_counter() - begin
    fleet.stop()
    done = [job for job in queue.get_all(ids) if job.state == "done" and job.attempts == 1]
    assert len(done) == len(ids)
    print(f"{workers:7d} {seconds:9.1f} {submitted:9.2f} {len(ids) / seconds:8.2f}", flush=True)
    return len(ids) / seconds


def _wait(true: Callable[[], bool]) -> None:
    while not true():
        time.sleep(0.2)


def main() -> None:
    """Print the table, or be one of the workers."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--jobs", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=0.1)
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--database")
    parser.add_argument("--work", action="store_true")
    arguments = parser.parse_args()
    if arguments.work:
        process.work = lambda url: work(url, kinds={"short": _KIND})
        sys.exit(process.main())
    with tempfile.TemporaryDirectory() as folder:
        queue = open_queue(arguments.database or f"{folder}/jobs.sqlite")
        print("workers   seconds submitted   jobs/s")
        rates = [measure(queue, Path(folder), workers, arguments) for workers in (1, 2, 4)]
        print("times one worker: " + ", ".join(f"{rate / rates[0]:.2f}" for rate in rates))
        queue.close()


if __name__ == "__main__":
    main()
