"""A claimed job, stage by stage, each a durable step."""

import logging
import socket
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from capture_app.commands.request import Request
from capture_app.jobs.engine import durable, others_waited_for, waited_for
from capture_app.jobs.job_errors import job_error
from capture_app.jobs.protocol import Attempt, JobKind, StagedJob
from capture_app.jobs.queue import JobQueue, order_id
from capture_app.jobs.record import JobError
from capture_app.jobs.reporter import JobCancelled, JobPostponed, JobReporter
from capture_app.jobs.worker_store import WorkerStore, result_may_exist

_log = logging.getLogger(__name__)


class JobLost(Exception):
    """The job is not this worker's any more."""


class ClaimedJob:
    """One attempt at one job. It is over in the tables only when nothing is left of it on the disk."""

    def __init__(
        self, ledger: WorkerStore, row: Mapping[str, Any], kinds: Mapping[str, JobKind]
    ) -> None:
        """`row` was claimed by this worker."""
        self._ledger, self._row = ledger, row
        self._kind = kinds.get(row["kind"])
        self._desk = JobReporter(row, self._kind.shares if self._kind else {})
        self._ending = row["state"] == "cancelling" or row["error"] is not None
        """Only cleaning is left, which need not hear that the job is unwanted."""
        self._waited_for: bool | None = None
        # From taking the news to having written it: the last writing must not overtake another.
        self._writing = threading.Lock()

    def run(self) -> None:
        """Go on to the end, whichever it is.

        Raises:
            JobLost: others have the job now.
        """
        work = self._begin()
        if work is None:
            return
        self._desk.timings_of = lambda: work.timings
        self._desk.say(f"Attempt {self._row['attempts']}, on {socket.gethostname()}.")
        steps = {"inputs": self._hash_inputs, **work.stages}
        *_, last = steps
        for name, stage in steps.items():
            given_up = self._row["error"] is not None and name != last
            do = self._give_up if given_up else self._do
            if not durable(name, lambda do=do, stage=stage: do(stage, work)):
                return
        self._end("done", {"fraction": 1.0, "error": None})

    def report(self) -> float:
        """Write what is new, and see whether the job is still wanted; for another thread.

        Returns:
            Seconds since the job was job_error that it is not.
        """
        with self._writing:
            state = self._ledger.write(self._row["id"], self._desk.news())
        if state == "cancelling":
            self._desk.cancel()
        return 0.0 if self._ending else self._desk.unwanted

    def let_others_first(self) -> None:
        """Put the job back into the queue soon, where another one is waited for; for another thread."""
        if self._waited_for is None:  # asked in the job's own thread, DBOS would note it as a step
            self._waited_for = waited_for(self._row["workflow"])
        if not self._waited_for and not self._ending and others_waited_for():
            self._desk.postpone()

    def _begin(self) -> StagedJob | None:
        """The job as it is now, or None when it was over before it began."""
        row, kind = self._row, self._kind
        if kind is None:
            self._fail(_unknown(row["kind"]), None)
            return None
        desk = self._desk
        attempt = Attempt(
            row["id"], desk.progress, desk.say, desk.tell, row["timings"], self._follow
        )
        try:
            work = kind.start(kind.order.model_validate(row["order"]), attempt)
        except Exception as error:
            self._fail(self._told(error), None)
            return None
        if row["error"] is not None and not result_may_exist(row):
            # An earlier attempt failed, and was killed while it cleaned up.
            self._fail(JobError.model_validate(row["error"]), work)
        elif row["state"] == "cancelling":
            self._cancelled(work)
        elif row["attempts"] > 1 and (changed := _changed(row["inputs"])):
            self._fail(changed, work)
        else:
            return work
        return None

    def _give_up(self, _: Callable[[], None], work: StagedJob) -> bool:
        """Fail with the error of the earlier attempts, without doing the stage."""
        self._fail(JobError.model_validate(self._row["error"]), work)
        return False

    def _follow(self, order: Request) -> str:
        """Order another job, once."""
        job_id = order_id(order)
        queue = JobQueue(self._ledger.database)
        try:
            if not queue.submit_all([(job_id, order)], waited_for=False):
                queue.again(job_id)  # of an earlier result in the same place
        finally:
            queue.let_go()
        return job_id

    def _do(self, stage: Callable[[], None], work: StagedJob) -> bool:
        """One stage; whether to go on."""
        try:
            self._desk.check_wanted()
            stage()
            work.settle()
        except JobCancelled:
            self._cancelled(work)
            return False
        except JobPostponed:
            self._postponed(work)
            return False
        except Exception as error:
            self._check_ours()
            self._fail(self._told(error), work)
            return False
        return True

    def _hash_inputs(self) -> None:
        self._ledger.write(self._row["id"], {"inputs": _hashed(self._row["inputs"])})

    def _fail(self, error: JobError, work: StagedJob | None) -> None:
        self._ending = True
        # Written before the cleaning, so that whoever finds it half cleaned knows why.
        self._ledger.write(self._row["id"], {"error": error.model_dump()})
        if work is not None:
            work.discard()
        self._end("failed", {"error": error.model_dump()})

    def _cancelled(self, work: StagedJob) -> None:
        self._ending = True
        work.discard()
        self._end("cancelled", {})

    def _postponed(self, work: StagedJob) -> None:
        self._ending = True
        work.discard()
        queue = JobQueue(self._ledger.database)
        try:
            with self._writing:
                self._desk.news()
                queue.postpone(self._row["id"], self._ledger.worker)
        finally:
            queue.let_go()

    def _end(self, state: Any, values: Mapping[str, Any]) -> None:
        with self._writing:
            news = {**self._desk.news(), **values}
            if not self._ledger.end(self._row["id"], state, news):
                raise JobLost

    def _check_ours(self) -> None:
        """Who lost the job may see its folder vanish: that is no fault of the job."""
        if self._ledger.write(self._row["id"], {}) is None:
            raise JobLost

    def _told(self, error: Exception) -> JobError:
        found = job_error(error)
        if found.code == "defect":
            _log.error("Job %s is a defect:", self._row["id"], exc_info=error)
        return found


def _hashed(inputs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    from capture_app.manifest import sha256

    paths = [Path(item["path"]) for item in inputs]
    return [
        {**item, "sha256": sha256(path) if path.exists() else None}
        for item, path in zip(inputs, paths, strict=True)
    ]


def _changed(inputs: list[dict[str, Any]]) -> JobError | None:
    """What earlier attempts made of other inputs is not mixed with these."""
    known = [item for item in inputs if item.get("sha256")]
    for before, now in zip(known, _hashed(known), strict=True):
        if before["sha256"] != now["sha256"]:
            return JobError(
                code="input-changed",
                what=f"The {now['role']} has changed since the job began.",
                where=now["path"],
                fix="Order the job again.",
            )
    return None


def _unknown(kind: str) -> JobError:
    return JobError(
        code="job-kind-unknown",
        what=f"This worker does not know jobs of the kind {kind!r}.",
        fix="Run the same version of omocap everywhere.",
    )
