"""The tables as a worker reads and writes them: rows, orders and records."""

import socket
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

import sqlalchemy as sa

from capture_app.commands.request import Request
from capture_app.jobs.database import JOBS, WORKERS, Database
from capture_app.jobs.job_record import JobError, JobRecord, State

_TIMES = ("created", "started", "ended")
_PLAIN = tuple(name for name in JobRecord.model_fields if name not in _TIMES)


def row_of(job_id: str, order: Request) -> dict[str, Any]:
    """A job that waits."""
    return {
        "id": job_id,
        "kind": order.KIND,
        "name": order.name,
        "order": order.model_dump(mode="json"),
        "inputs": [{"role": role, "path": str(path)} for role, path in order.inputs.items()],
        "options": order.options,
        "output": str(order.output),
        "workflow": new_workflow(job_id),
        "created": time.time(),
    }


def new_workflow(job_id: str) -> str:
    """A name for the DBOS workflow of a job that nothing had before."""
    return f"{job_id}-{uuid4().hex[:16]}"


def rows(c: sa.Connection, statement: sa.Executable) -> list[dict[str, Any]]:
    """Return the rows that a question or a change with RETURNING gives."""
    result = c.execute(statement)
    columns = list(result.keys())
    return [dict(zip(columns, row, strict=True)) for row in result]


def record_of(row: Mapping[str, Any]) -> JobRecord:
    """Return a row as people and programs are told of it."""
    times = {name: _time(row[name]) for name in _TIMES}
    return JobRecord.model_validate({**{name: row[name] for name in _PLAIN}, **times})


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


DEADLIEST = 3
"""A job that so many workers died of is not given to another. Those count whose starter lived on and
saw it: what ends a whole machine, or all of its processes, is no fault of a job."""

_DEADLY = JobError(
    code="job-kills-worker",
    what=f"{DEADLIEST} workers died while they were at this job; most likely the machine's memory "
    "was too small for it.",
    fix="Order fewer samples or a smaller video, cut the take into shorter ones, run fewer workers "
    "on the machine, or use one with more memory.",
)


_FREED = {
    "worker": None,
    "state": sa.case((JOBS.c.state == "running", "queued"), else_=JOBS.c.state),
}


def worker_name(pid: int, tail: str = "") -> str:
    """Return the name of a worker process of this machine; without a tail, the beginning of its name."""
    return f"{socket.gethostname()}-{pid}-{tail}"


def count_death(database: Database, pid: int) -> None:
    """Free the job that a worker process of this machine died of, or give it up as deadly."""
    begins = worker_name(pid)
    deaths = JOBS.c.deaths + 1
    error = sa.case((deaths >= DEADLIEST, _json(_DEADLY)), else_=JOBS.c.error)
    with database.begin() as c:
        c.execute(sa.delete(WORKERS).where(WORKERS.c.id.startswith(begins, autoescape=True)))
        its = JOBS.c.worker.startswith(begins, autoescape=True)
        c.execute(sa.update(JOBS).where(its).values({**_FREED, "deaths": deaths, "error": error}))


def result_may_exist(row: Mapping[str, Any]) -> bool:
    """Return whether a job that was given up as deadly may have its result in place already.

    A worker may die after it has put the result there and before it has said so. The last stage, which
    is then done again, finds it; a job of which still more workers die is given up all the same.
    """
    return row["error"]["code"] == _DEADLY.code and row["deaths"] < 2 * DEADLIEST


class WorkerStore:
    """The tables, as one worker sees them."""

    def __init__(self, database: Database, worker: str) -> None:
        """`worker` names this process among all that ever were."""
        self.database, self.worker = database, worker
        self._ours = JOBS.c.worker == worker

    def join(self) -> None:
        """Say that this worker lives."""
        with self.database.begin() as c:
            row = {"id": self.worker, "host": socket.gethostname(), "beat": self.database.now}
            c.execute(sa.insert(WORKERS).values(row))

    def beat(self) -> bool:
        """Say it again.

        Returns:
            False when others have taken this worker for dead, and its jobs.
        """
        mine = sa.update(WORKERS).where(WORKERS.c.id == self.worker)
        with self.database.begin() as c:
            return c.execute(mine.values(beat=self.database.now)).rowcount == 1

    def leave(self) -> None:
        """Hand back what this worker is at; whoever takes it goes on where this one stopped."""
        with self.database.begin() as c:
            c.execute(sa.update(JOBS).where(self._ours).values(_FREED))
            c.execute(sa.delete(WORKERS).where(WORKERS.c.id == self.worker))

    def free_silent(self, silence: float) -> set[str]:
        """Free the jobs of workers that have not been heard of for so many seconds.

        Returns:
            The workers that live.
        """
        living = sa.select(WORKERS.c.id)
        with self.database.begin() as c:
            c.execute(sa.delete(WORKERS).where(WORKERS.c.beat < self.database.now - silence))
            orphaned = sa.and_(JOBS.c.worker.is_not(None), JOBS.c.worker.not_in(living))
            c.execute(sa.update(JOBS).where(orphaned).values(_FREED))
            return set(c.execute(living).scalars())

    def claim(self, job_id: str, workflow: str) -> dict[str, Any] | None:
        """Take a job from the queue.

        Returns:
            Its row; None when it is over, gone, or was ordered again and has another workflow.
        """
        dead = JOBS.c.worker.not_in(sa.select(WORKERS.c.id))
        free = sa.and_(
            JOBS.c.workflow == workflow,
            JOBS.c.state.in_(("queued", "running", "cancelling")),
            sa.or_(JOBS.c.worker.is_(None), dead),
        )
        taken = {
            "worker": self.worker,
            "attempts": JOBS.c.attempts + 1,
            "state": sa.case((JOBS.c.state == "cancelling", "cancelling"), else_="running"),
            "started": sa.func.coalesce(JOBS.c.started, self.database.now),
        }
        with self.database.begin() as c:
            claim = sa.update(JOBS).where(JOBS.c.id == job_id, free).values(taken)
            return next(iter(rows(c, claim.returning(JOBS))), None)

    def write(self, job_id: str, values: Mapping[str, Any]) -> State | None:
        """Write to a job of this worker.

        Returns:
            The state it is in; None when it is not this worker's any more.
        """
        ours = sa.and_(JOBS.c.id == job_id, self._ours)
        with self.database.begin() as c:
            if not values:
                return c.execute(sa.select(JOBS.c.state).where(ours)).scalar()
            change = sa.update(JOBS).where(ours).values(dict(values)).returning(JOBS.c.state)
            return c.execute(change).scalar()

    def end(self, job_id: str, state: State, values: Mapping[str, Any]) -> bool:
        """A job of this worker is over.

        Returns:
            False when it is not this worker's any more.
        """
        over = {**values, "state": state, "worker": None, "ended": self.database.now}
        return self.write(job_id, over) is not None


def _json(error: JobError) -> sa.ColumnElement[Any]:
    return sa.literal(error.model_dump(), JOBS.c.error.type)
