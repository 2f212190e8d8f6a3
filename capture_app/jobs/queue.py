"""The queue as everyone sees it who orders jobs: submit, look, cancel, delete."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from typing import Any
from uuid import uuid4

import sqlalchemy as sa
from dbos import EnqueueOptions

from capture_app.commands.request import Request
from capture_app.jobs.database import JOBS, WORKERS, Database
from capture_app.jobs.engine import QUEUE, WORKFLOW, client_of
from capture_app.jobs.job_record import OVER, JobRecord, State
from capture_app.jobs.worker_store import count_death, new_workflow, record_of, row_of, rows
from omomo_core.errors import InputError

_LAST = 1_000
"""DBOS' priority of what nobody waits for; jobs without one come first."""
_FIRST_LOOK = 5.0
"""Seconds before such a job may begin: whoever has just got a result looks at it first."""
_AT_ONCE = 500
"""Ids in one question; SQLite has a bound."""


def open_queue(database_url: str, *, patience: float = 30.0) -> "JobQueue":
    """The queue in a database, which is made if it is not there.

    Args:
        database_url: "sqlite:///jobs.sqlite", a path, or "postgresql://...".
        patience: seconds to wait for a database that others have locked.

    Raises:
        InputError: "jobs-database-..." when it cannot be used.
    """
    return JobQueue(Database(database_url, patience=patience))


def order_id(order: Request) -> str:
    """An id for an order: the same for the same order, whatever it is called."""
    said = [order.KIND, order.model_dump(mode="json", exclude={"name"})]
    return sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]


class JobQueue:
    """Every method may raise InputError "jobs-database-..."."""

    def __init__(self, database: Database) -> None:
        """See `open_queue`."""
        self._database = database
        self._dbos = client_of(database)

    @property
    def database_url(self) -> str:
        """The address of the database for workers; it has the password in it."""
        return self._database.url

    @property
    def shown(self) -> str:
        """The name of the database, for people."""
        return self._database.shown

    def workers(self, silence: float = 15.0) -> int:
        """Return how many workers have been heard of in the last seconds."""
        alive = WORKERS.c.beat > self._database.now - silence
        with self._database.begin() as c:
            return c.execute(
                sa.select(sa.func.count()).select_from(WORKERS).where(alive)
            ).scalar_one()

    def worker_died(self, pid: int) -> None:
        """A worker process of this machine was killed, or crashed: its job is freed, and remembers it."""
        count_death(self._database, pid)

    def counts(self) -> dict[State, int]:
        """Return how many jobs are in each state; a state that none is in is left out."""
        asked = sa.select(JOBS.c.state, sa.func.count()).group_by(JOBS.c.state)
        with self._database.begin() as c:
            return {state: count for state, count in c.execute(asked)}

    def submit(self, order: Request, *, id: str | None = None) -> JobRecord:
        """Put one job into the queue; the same id again changes nothing.

        Args:
            order: what to do.
            id: 16 lower-case hex digits; made up if not given.

        Returns:
            The job, or the one that has the id already.
        """
        job_id = id or uuid4().hex[:16]
        self.submit_all([(job_id, order)])
        record = self.get(job_id)
        assert record is not None
        return record

    def submit_all(self, orders: Iterable[tuple[str, Request]], *, waited_for: bool = True) -> int:
        """Put many jobs into the queue in one transaction: all or none.

        Args:
            orders: with their ids.
            waited_for: somebody waits for these; others are begun after some seconds, when no such job
                waits.

        Returns:
            How many were not there yet.
        """
        new_rows = {_checked(job_id): row_of(job_id, order) for job_id, order in orders}
        with self._database.begin() as c:
            known = self._known(c, list(new_rows))
            new = [row for job_id, row in new_rows.items() if job_id not in known]
            if new:
                c.execute(sa.insert(JOBS), new)
            for row in new:
                self._enqueue(c, row["id"], row["workflow"], waited_for=waited_for)
        return len(new)

    def adopt(self, id: str, order: Request, *, timings: Mapping[str, float], summary: Any) -> None:
        """Note a job that was done before this queue knew of it; nothing where it does.

        Args:
            id: as of `submit`.
            order: what was done.
            timings, summary: as of a `JobRecord`.
        """
        done = {"state": "done", "fraction": 1.0, "timings": dict(timings), "summary": summary}
        with self._database.begin() as c:
            if not self._known(c, [id]):
                row = {**row_of(_checked(id), order), **done, "ended": self._database.now}
                c.execute(sa.insert(JOBS).values(row))

    def get(self, id: str) -> JobRecord | None:
        """One job; None if there is no such job."""
        found = self.get_all([id])
        return found[0] if found else None

    def get_all(self, ids: Sequence[str]) -> list[JobRecord]:
        """Those jobs that there are, in the order of the ids."""
        records: dict[str, JobRecord] = {}
        with self._database.begin() as c:
            for k in range(0, len(ids), _AT_ONCE):
                some = sa.select(JOBS).where(JOBS.c.id.in_(ids[k : k + _AT_ONCE]))
                records |= {row["id"]: record_of(row) for row in rows(c, some)}
        return [records[id] for id in ids if id in records]

    def list(self, limit: int = 100, state: State | None = None) -> "list[JobRecord]":
        """The latest jobs, the newest first."""
        statement = sa.select(JOBS).order_by(JOBS.c.created.desc(), JOBS.c.id).limit(limit)
        if state is not None:
            statement = statement.where(JOBS.c.state == state)
        with self._database.begin() as c:
            return [record_of(row) for row in rows(c, statement)]

    def cancel(self, id: str) -> JobRecord | None:
        """Stop a job: at once if it waits, else within a second or two; nothing if it is over."""
        untouched = sa.and_(JOBS.c.state == "queued", JOBS.c.attempts == 0)
        with self._database.begin() as c:
            c.execute(
                sa.update(JOBS)
                .where(JOBS.c.id == id, JOBS.c.state.in_(("queued", "running")))
                .values(
                    state=sa.case((untouched, "cancelled"), else_="cancelling"),
                    ended=sa.case((untouched, self._database.now), else_=None),
                )
            )
        return self.get(id)

    def postpone(self, id: str, worker: str) -> None:
        """Put a job that nobody waits for, and that a worker has begun, behind those that wait."""
        workflow = new_workflow(id)
        begun = sa.and_(JOBS.c.id == id, JOBS.c.worker == worker, JOBS.c.state == "running")
        later = {"workflow": workflow, "state": "queued", "worker": None, "fraction": 0.0}
        with self._database.begin() as c:
            if c.execute(sa.update(JOBS).where(begun).values(later)).rowcount:
                self._enqueue(c, id, workflow, waited_for=False)

    def again(self, id: str) -> JobRecord | None:
        """Put a job that is over into the queue once more, from its beginning."""
        workflow = new_workflow(id)
        fresh = {
            "workflow": workflow,
            "state": "queued",
            "stage": "",
            "fraction": 0.0,
            "timings": {},
            "summary": {},
            "error": None,
            "deaths": 0,
            "attempts": 0,
            "started": None,
            "ended": None,
        }
        over = JOBS.c.state.in_(OVER)
        with self._database.begin() as c:
            if c.execute(sa.update(JOBS).where(JOBS.c.id == id, over).values(fresh)).rowcount:
                self._enqueue(c, id, workflow)
        return self.get(id)

    def delete(self, id: str) -> None:
        """Forget a job that is over; its result stays. Nothing if there is no such job.

        Raises:
            InputError: "job-active".
        """
        with self._database.begin() as c:
            row = c.execute(sa.select(JOBS.c.state, JOBS.c.workflow).where(JOBS.c.id == id)).first()
            if row is None:
                return
            over = sa.and_(JOBS.c.workflow == row.workflow, JOBS.c.state.in_(OVER))
            if not c.execute(sa.delete(JOBS).where(JOBS.c.id == id, over)).rowcount:
                raise InputError(
                    "job-active", "The job is not over yet.", where=id, fix="Cancel it first."
                )
        self._dbos.delete_workflow(row.workflow)

    def let_go(self) -> None:
        """Leave the database open for others."""
        self._dbos.destroy()

    def close(self) -> None:
        """Let go, and close the database."""
        self.let_go()
        self._database.close()

    def _known(self, c: sa.Connection, ids: Sequence[str]) -> set[str]:
        known: set[str] = set()
        for k in range(0, len(ids), _AT_ONCE):
            some = sa.select(JOBS.c.id).where(JOBS.c.id.in_(ids[k : k + _AT_ONCE]))
            known.update(c.execute(some).scalars())
        return known

    def _enqueue(
        self, c: sa.Connection, id: str, workflow: str, *, waited_for: bool = True
    ) -> None:
        options: EnqueueOptions = {
            "workflow_name": WORKFLOW,
            "queue_name": QUEUE,
            "workflow_id": workflow,
        }
        if not waited_for:
            options["priority"], options["delay_seconds"] = _LAST, _FIRST_LOOK
        self._dbos.enqueue_in_transaction(c, options, id)


def _checked(job_id: str) -> str:
    if not re.fullmatch(r"[0-9a-f]{16}", job_id):
        raise InputError(
            "job-id-invalid",
            f"{job_id!r} is no id of a job.",
            fix="Give 16 lower-case hex digits, or none.",
        )
    return job_id
