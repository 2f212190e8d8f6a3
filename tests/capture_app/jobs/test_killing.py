"""Workers killed at random: nothing lost, nothing doubled, no half file, nothing left."""

import os
import random
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Start
from waiting import check_done, check_nothing_left, finished, orders, pids, until

from capture_app.jobs.fleet import Fleet
from capture_app.jobs.queue import JobQueue, open_queue


def kill_at_random(fleet: Fleet, count: int, rng: random.Random, longest: float) -> None:
    for _ in range(count):
        time.sleep(rng.uniform(0.0, longest))
        until(lambda: bool(pids(fleet)))
        try:
            os.kill(rng.choice(pids(fleet)), signal.SIGKILL)
        except (ProcessLookupError, IndexError):
            continue  # it died by itself meanwhile


def check_all(queue: JobQueue, ids: list[str], folder: Path, seconds: float) -> None:
    for record in finished(queue, ids, seconds):
        if record.state == "failed":  # by bad luck its worker was shot three times
            assert record.error is not None
            assert record.error.code == "job-kills-worker"
            assert not Path(record.output or "").exists()
        else:
            check_done(record)
    check_nothing_left(folder)


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_a_few_kills(
    kind: str, request: pytest.FixtureRequest, tmp_path: Path, start: Start
) -> None:
    new: Callable[[], str] = (
        request.getfixturevalue("postgres")
        if kind == "postgres"
        else lambda: str(tmp_path / "jobs.sqlite")
    )
    queue = open_queue(new())
    many = orders(tmp_path / "out", 4, seconds=0.4)
    queue.submit_all(many)
    fleet = start(queue, 2)
    until(lambda: any(record.fraction > 0 for record in queue.list()))
    kill_at_random(fleet, 2, random.Random(0), 0.6)
    check_all(queue, [id for id, _ in many], tmp_path / "out", 60.0)
    queue.close()


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_sixty_kills(queue: JobQueue, tmp_path: Path, start: Start) -> None:
    many = orders(tmp_path / "out", 100, seconds=0.15)
    queue.submit_all(many)
    ids = [id for id, _ in many]
    fleet = start(queue, 4)
    until(lambda: any(record.fraction > 0 for record in queue.get_all(ids)))
    kill_at_random(fleet, 60, random.Random(1), 0.8)
    check_all(queue, ids, tmp_path / "out", 900.0)
    attempts = sum(record.attempts for record in queue.get_all(ids))
    assert attempts > 102  # the shots did hit workers at work
