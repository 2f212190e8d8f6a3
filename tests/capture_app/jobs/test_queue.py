"""Submitting, looking, cancelling, deleting: without a worker."""

import sqlite3
import time
from pathlib import Path

import pytest
from stand_in import StandInOrder
from waiting import orders

from capture_app.commands.run import RunRequest
from capture_app.jobs.queue import JobQueue, open_queue, order_id
from omomo_core.errors import InputError


def test_a_new_job_waits_and_tells_what_was_ordered(queue: JobQueue, tmp_path: Path) -> None:
    order = RunRequest(
        name="Chair", session=tmp_path / "take", object=tmp_path / "a.obj", output=tmp_path / "out"
    )
    made = queue.submit(order)
    assert queue.get(made.id) == made
    assert (made.kind, made.name, made.state, made.fraction) == ("run", "Chair", "queued", 0.0)
    assert made.output == str(tmp_path / "out")
    assert {item.role: item.path for item in made.inputs} == {
        "session": str(tmp_path / "take"),
        "object": str(tmp_path / "a.obj"),
    }
    assert made.options["samples"] == 4
    assert "session" not in made.options


def test_the_same_id_again_is_the_same_job(queue: JobQueue, tmp_path: Path) -> None:
    first = queue.submit(StandInOrder(name="one", output=tmp_path / "a"), id="0123456789abcdef")
    again = queue.submit(StandInOrder(name="two", output=tmp_path / "b"), id="0123456789abcdef")
    assert again == first
    assert queue.list() == [first]


def test_many_are_submitted_fast_and_at_most_once(queue: JobQueue, tmp_path: Path) -> None:
    many = orders(tmp_path, 2000)
    begin = time.monotonic()
    assert queue.submit_all(many) == 2000
    assert time.monotonic() - begin < 10.0
    assert queue.submit_all([*many, ("f" * 16, many[0][1])]) == 1
    assert len(queue.list(limit=5000)) == 2001
    assert [r.id for r in queue.get_all([many[7][0], many[3][0]])] == [many[7][0], many[3][0]]


@pytest.mark.parametrize("id", ["", "0123", "0123456789ABCDEF", "../../etc/passwd", "g" * 16])
def test_only_ids_of_the_right_form_are_taken(tmp_path: Path, id: str) -> None:
    queue = open_queue(str(tmp_path / "jobs.sqlite"))
    with pytest.raises(InputError) as caught:
        queue.submit_all([(id, StandInOrder(output=tmp_path / "a"))])
    assert caught.value.code == "job-id-invalid"
    assert queue.list() == []
    queue.close()


def test_the_id_of_an_order_is_of_what_is_ordered_and_not_of_its_name(tmp_path: Path) -> None:
    order = StandInOrder(name="one", output=tmp_path / "a")
    assert order_id(order) == order_id(order.model_copy(update={"name": "two"}))
    assert order_id(order) != order_id(order.model_copy(update={"seconds": 3.0}))


def test_a_job_that_waits_is_cancelled_at_once_and_may_be_ordered_again(
    queue: JobQueue, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "a"))
    gone = queue.cancel(made.id)
    assert gone is not None
    assert gone.state == "cancelled"
    assert gone.ended is not None
    assert queue.cancel(made.id) == gone
    again = queue.again(made.id)
    assert again is not None
    assert (again.state, again.ended) == ("queued", None)
    assert queue.again(made.id) == again
    assert queue.cancel("0" * 16) is None


def test_only_what_is_over_is_deleted(queue: JobQueue, tmp_path: Path) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "a"))
    with pytest.raises(InputError) as caught:
        queue.delete(made.id)
    assert caught.value.code == "job-active"
    queue.cancel(made.id)
    queue.delete(made.id)
    queue.delete(made.id)
    assert queue.get(made.id) is None
    assert queue.submit(StandInOrder(output=tmp_path / "a"), id=made.id).state == "queued"


def test_jobs_are_listed_by_state_the_newest_first(queue: JobQueue, tmp_path: Path) -> None:
    ids = [queue.submit(StandInOrder(output=tmp_path / str(k))).id for k in range(3)]
    queue.cancel(ids[1])
    assert [r.id for r in queue.list()] == ids[::-1]
    assert [r.id for r in queue.list(limit=1)] == [ids[2]]
    assert [r.id for r in queue.list(state="cancelled")] == [ids[1]]


@pytest.mark.parametrize("left", [10, 3000, 20000])
def test_a_truncated_file_is_called_damaged(tmp_path: Path, left: int) -> None:
    file = tmp_path / "jobs.sqlite"
    queue = open_queue(str(file))
    queue.submit_all(orders(tmp_path, 200))
    queue.close()
    with file.open("r+b") as raw:
        raw.truncate(left)
    with pytest.raises(InputError) as caught:
        open_queue(str(file))
    assert caught.value.code == "jobs-database-damaged"
    assert str(file) in caught.value.where


def test_a_file_of_something_else_is_not_written_to(tmp_path: Path) -> None:
    file = tmp_path / "thesis.tex"
    file.write_text("years of work " * 100)
    with pytest.raises(InputError) as caught:
        open_queue(str(file))
    assert caught.value.code == "jobs-database-damaged"
    assert file.read_text() == "years of work " * 100


def test_a_locked_file_is_waited_for_and_then_named(tmp_path: Path) -> None:
    file = tmp_path / "jobs.sqlite"
    queue = open_queue(str(file), patience=0.2)
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(InputError) as caught:
        queue.submit(StandInOrder(output=tmp_path / "a"))
    assert caught.value.code == "jobs-database-locked"
    other.close()
    assert queue.submit(StandInOrder(output=tmp_path / "a")).state == "queued"
    queue.close()


def test_a_database_that_does_not_answer_is_named_without_its_password() -> None:
    with pytest.raises(InputError) as caught:
        open_queue("postgresql://me:secret@127.0.0.1:9/jobs", patience=2.0)
    assert caught.value.code == "jobs-database-unreachable"
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("url", ["mysql://localhost/a", "://", "postgresql+nothing://x:y:z/"])
def test_other_databases_are_refused(url: str) -> None:
    with pytest.raises(InputError) as caught:
        open_queue(url)
    assert caught.value.code == "jobs-database-url"
