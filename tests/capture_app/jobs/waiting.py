"""Waiting for jobs, and looking at what they left."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from stand_in import STEPS, StandInOrder

from capture_app.jobs.fleet import Fleet
from capture_app.jobs.job_record import OVER, JobRecord
from capture_app.jobs.queue import JobQueue


def until(true: Callable[[], bool], seconds: float = 120.0) -> float:
    """Waits; seconds that it took."""
    begin = time.monotonic()
    while not true():
        waited = time.monotonic() - begin
        assert waited < seconds, "waited in vain"
        time.sleep(0.02)
    return time.monotonic() - begin


def pids(fleet: Fleet) -> list[int]:
    """Process ids of the workers that run now."""
    return [p.pid for p in fleet._processes.values() if p.poll() is None]


def state(queue: JobQueue, id: str) -> str:
    record = queue.get(id)
    assert record is not None
    return record.state


def finished(queue: JobQueue, ids: Sequence[str], seconds: float = 240.0) -> list[JobRecord]:
    """The jobs when all are over."""
    until(lambda: all(record.state in OVER for record in queue.get_all(ids)), seconds)
    records = queue.get_all(ids)
    assert [record.id for record in records] == list(ids)
    return records


def orders(folder: Path, count: int, **options: object) -> list[tuple[str, StandInOrder]]:
    """Stand-ins with ids, each with a result folder of its own."""
    return [
        (f"{k:016x}", StandInOrder(name=f"job {k}", output=folder / f"{k}", **options))
        for k in range(count)
    ]


def check_done(record: JobRecord) -> None:
    """The result is whole, and no finished stage was done again."""
    assert record.state == "done", record
    assert (record.fraction, record.error) == (1.0, None)
    output = Path(record.output or "")
    assert sorted(path.name for path in output.iterdir()) == ["manifest.json", "stages.txt"]
    lines = (output / "stages.txt").read_text().split()
    assert list(dict.fromkeys(lines)) == list(STEPS)
    # Each new attempt may repeat the one stage in which the last one was killed.
    assert len(lines) <= len(STEPS) + record.attempts - 1


def check_nothing_left(folder: Path) -> None:
    assert [path.name for path in folder.iterdir() if path.name.startswith(".")] == []
