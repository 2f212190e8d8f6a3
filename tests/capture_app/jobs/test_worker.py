"""Jobs that are done, fail, are cancelled, handed back, and taken over."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import Start
from stand_in import StandInOrder
from waiting import check_done, check_nothing_left, finished, orders, pids, state, until

from capture_app.jobs.batch_watch import watch
from capture_app.jobs.fleet import Fleet
from capture_app.jobs.queue import JobQueue, open_queue
from capture_app.jobs.worker_store import DEADLIEST
from omomo_core.errors import InputError


def test_jobs_are_done_whole_by_several_workers(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    source = tmp_path / "source.txt"
    source.write_text("it")
    many = orders(tmp_path / "out", 8, source=source)
    queue.submit_all(many)
    start(queue, 2)
    for record in finished(queue, [id for id, _ in many]):
        check_done(record)
        assert record.attempts == 1
        assert record.inputs[0].sha256 is not None
        assert record.summary == {"made": Path(record.output or "").name}
        assert record.started is not None
        assert record.ended is not None
        assert record.created <= record.started <= record.ended
    check_nothing_left(tmp_path / "out")


def test_what_nobody_waits_for_comes_last(queue: JobQueue, start: Start, tmp_path: Path) -> None:
    patient, *others = orders(tmp_path / "out", 3)
    queue.submit_all([patient], waited_for=False)
    queue.submit_all(others)
    start(queue)
    last, *first = finished(queue, [id for id, _ in (patient, *others)])
    assert last.started is not None
    assert all(record.ended and record.ended <= last.started for record in first)


def test_what_nobody_waits_for_steps_back_and_is_done_later(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    patient, other = orders(tmp_path / "out", 2, seconds=1.0)
    queue.submit_all([patient], waited_for=False)
    start(queue)
    until(lambda: [record.stage for record in queue.get_all([patient[0]])] == ["second"])
    queue.submit_all([other])
    later, first = finished(queue, [patient[0], other[0]])
    for record in (later, first):
        check_done(record)
    assert first.started is not None
    assert later.ended is not None
    assert first.ended is not None
    assert (first.started - first.created).total_seconds() < 1.0
    assert first.ended < later.ended
    assert (first.attempts, later.attempts) == (1, 2)
    check_nothing_left(tmp_path / "out")


def test_a_failure_is_told_in_words_and_stops_no_other(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    faults = ["input", "defect", "memory", ""]
    many = [
        (f"{k:016x}", StandInOrder(output=tmp_path / "out" / str(k), fault=fault))
        for k, fault in enumerate(faults)
    ]
    queue.submit_all(many)
    queue.submit(StandInOrder(output=tmp_path / "out" / "3"), id="f" * 16)
    start(queue)
    wrong, defect, memory, good, second = finished(queue, [*(id for id, _ in many), "f" * 16])
    assert wrong.error is not None
    assert (wrong.error.code, wrong.error.where, wrong.error.fix) == ("made-up", "here", "Mend it.")
    assert defect.error is not None
    assert defect.error.what == "This is a defect of omocap: KeyError."
    assert "secret" not in defect.model_dump_json()
    assert "Traceback" in (tmp_path / "workers.log").read_text()
    assert memory.error is not None
    assert memory.error.code == "out-of-memory"
    check_done(good)
    assert second.error is not None
    assert second.error.code == "output-exists"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["3"]


def test_a_running_job_is_cancelled_within_a_second_or_two(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", seconds=60.0))
    start(queue)
    until(lambda: (queue.get(made.id) or made).fraction > 0)
    assert next((tmp_path / "out").iterdir()).name.endswith(".part")
    assert (queue.cancel(made.id) or made).state == "cancelling"
    assert until(lambda: state(queue, made.id) == "cancelled") < 2.0
    assert list((tmp_path / "out").iterdir()) == []


def test_a_job_that_does_not_listen_is_cancelled_all_the_same(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", fault="deaf"))
    start(queue)
    until(lambda: (queue.get(made.id) or made).stage == "first")
    until(lambda: "second" in next((tmp_path / "out").rglob("stages.txt")).read_text())
    queue.cancel(made.id)
    assert finished(queue, [made.id])[0].state == "cancelled"
    assert list((tmp_path / "out").iterdir()) == []
    other = queue.submit(StandInOrder(output=tmp_path / "out" / "b"))
    check_done(finished(queue, [other.id])[0])


def test_a_killed_workers_job_goes_on_with_another_after_the_last_finished_stage(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", seconds=1.0))
    fleet = start(queue)
    until(lambda: (queue.get(made.id) or made).stage == "second")
    os.kill(pids(fleet)[0], signal.SIGKILL)
    record = finished(queue, [made.id])[0]
    check_done(record)
    assert record.attempts == 2
    assert "first" not in (tmp_path / "out" / "a" / "stages.txt").read_text().split()[1:]
    check_nothing_left(tmp_path / "out")


def test_a_stopped_worker_hands_its_job_back(queue: JobQueue, start: Start, tmp_path: Path) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", seconds=1.0))
    fleet = start(queue)
    until(lambda: (queue.get(made.id) or made).stage == "second")
    fleet.stop()
    handed = queue.get(made.id)
    assert handed is not None
    assert handed.state == "queued"
    start(queue)
    record = finished(queue, [made.id])[0]
    check_done(record)
    assert record.attempts == 2


@pytest.mark.slow
def test_a_job_that_waits_half_done_is_cancelled_and_leaves_nothing(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", seconds=2.0))
    fleet = start(queue)
    until(lambda: (queue.get(made.id) or made).stage == "first")
    fleet.stop()
    queue.cancel(made.id)
    assert list((tmp_path / "out").iterdir()) != []
    start(queue)
    assert finished(queue, [made.id])[0].state == "cancelled"
    assert list((tmp_path / "out").iterdir()) == []


def test_a_job_is_not_blamed_when_everything_on_its_machine_is_killed(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    """Starter and worker alike, as by a power cut: nobody is left who could note the death."""
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", seconds=0.4))
    for attempt in range(1, DEADLIEST + 2):
        fleet = start(queue, died=lambda pid: None)
        until(lambda: (queue.get(made.id) or made).attempts == attempt)  # noqa: B023
        pid = pids(fleet)[0]
        fleet._stop.set()  # it starts no other
        os.kill(pid, signal.SIGKILL)
    start(queue)
    record = finished(queue, [made.id])[0]
    check_done(record)
    assert record.attempts > DEADLIEST


def test_a_full_disk_ends_a_batch_and_leaves_the_rest_for_later(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    full = queue.submit(StandInOrder(output=tmp_path / "out" / "a", fault="full"))
    rest = queue.submit(StandInOrder(output=tmp_path / "out" / "b", seconds=60.0))
    start(queue)
    ids = [full.id, rest.id]
    with pytest.raises(InputError, match="2 sessions are not done") as caught:
        watch(queue, ids, lambda ended, running: None, pause=0.05)
    assert caught.value.code == "disk-full"
    assert "same command" in caught.value.fix
    told = queue.get(full.id)
    assert told is not None
    assert told.error is not None
    assert told.error.code == "disk-full"


def test_a_batch_ends_when_its_workers_cannot_write_what_became_of_their_jobs(
    tmp_path: Path,
) -> None:
    code = "from capture_app.jobs.fleet import NO_ROOM; raise SystemExit(NO_ROOM)"
    fleet = Fleet("", 1, command=[sys.executable, "-c", code], died=pytest.fail)
    empty = open_queue(str(tmp_path / "jobs.sqlite"))
    made = empty.submit(StandInOrder(output=tmp_path / "a"))
    assert not fleet.full
    fleet.start()
    with pytest.raises(InputError, match="1 sessions are not done") as caught:
        watch(empty, [made.id], lambda ended, running: None, pause=0.05, full=lambda: fleet.full)
    assert caught.value.code == "disk-full"
    fleet.stop()
    empty.close()


def test_a_job_that_kills_its_workers_fails_the_third_time(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", fault="kill"))
    good = queue.submit(StandInOrder(output=tmp_path / "out" / "b"))
    start(queue)
    deadly, other = finished(queue, [made.id, good.id])
    assert deadly.state == "failed"
    assert deadly.error is not None
    assert deadly.error.code == "job-kills-worker"
    check_done(other)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["b"]


def test_a_job_whose_result_is_whole_is_done_however_many_workers_died_of_it(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", fault="late"))
    start(queue)
    record = finished(queue, [made.id])[0]
    check_done(record)
    assert record.attempts == DEADLIEST + 1
    check_nothing_left(tmp_path / "out")


@pytest.mark.slow
def test_an_input_that_changed_meanwhile_is_not_mixed_in(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    source = tmp_path / "source.txt"
    source.write_text("one")
    order = StandInOrder(output=tmp_path / "out" / "a", seconds=1.0, source=source)
    made = queue.submit(order)
    fleet = start(queue)
    until(lambda: (queue.get(made.id) or made).stage == "second")
    fleet.stop()
    source.write_text("two")
    start(queue)
    record = finished(queue, [made.id])[0]
    assert record.error is not None
    assert (record.error.code, record.error.where) == ("input-changed", str(source))
    assert list((tmp_path / "out").iterdir()) == []
    queue.again(made.id)
    check_done(finished(queue, [made.id])[0])


def test_a_worker_whose_fellows_buried_it_ends(
    queue: JobQueue, start: Start, tmp_path: Path
) -> None:
    """As after a laptop's sleep: another one has its job now."""
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a", seconds=0.8))
    fleet = start(queue, 1)
    until(lambda: (queue.get(made.id) or made).stage == "second")
    sleeper = pids(fleet)[0]
    os.kill(sleeper, signal.SIGSTOP)
    start(queue, 1)
    record = finished(queue, [made.id])[0]
    os.kill(sleeper, signal.SIGCONT)
    until(lambda: sleeper not in pids(fleet), 5.0)
    check_done(record)
    assert state(queue, made.id) == "done"
    check_nothing_left(tmp_path / "out")


def test_workers_end_when_their_starter_is_killed(tmp_path: Path) -> None:
    here = Path(__file__).parent
    script = (
        f"import sys, time; sys.path.insert(0, {str(here)!r})\n"
        "from capture_app.jobs.fleet import Fleet\n"
        f"fleet = Fleet({str(tmp_path / 'jobs.sqlite')!r}, 1, log=__import__('pathlib').Path("
        f"{str(tmp_path / 'log')!r}), command=[sys.executable, {str(here / 'worker_process.py')!r}])\n"
        "fleet.start()\n"
        "from waiting import pids\n"
        "print((pids(fleet) or time.sleep(1) or pids(fleet))[0], flush=True)\n"
        "time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as starter:
        assert starter.stdout is not None
        worker = int(starter.stdout.readline())
        until(lambda: "is ready" in _read(tmp_path / "log"))
        starter.kill()
    until(lambda: not Path(f"/proc/{worker}").exists() or "has stopped" in _read(tmp_path / "log"))


def _read(log: Path) -> str:
    return log.read_text() if log.exists() else ""
