"""A claimed job, stage by stage, each a durable step, and the reports of how far it is."""

import logging
import socket
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from capture_app.commands.request import Request
from capture_app.jobs.engine import durable, others_waited_for, waited_for
from capture_app.jobs.job_kinds import Attempt, JobKind, StagedJob
from capture_app.jobs.job_record import LONGEST_LOG, JobError, job_error
from capture_app.jobs.queue import JobQueue, order_id
from capture_app.jobs.worker_store import WorkerStore, result_may_exist


class JobCancelled(BaseException):
    """Its owner does not want the job any more; no handler of errors is meant to catch this."""


class JobPostponed(BaseException):
    """Somebody waits for another job, and nobody for this one, which goes back into the queue."""


class JobReporter:
    """Progress, log, timings and summary of a job, until they are written to the database."""

    def __init__(self, row: Mapping[str, Any], shares: Mapping[str, float]) -> None:
        """Begin where the last attempt stopped.

        Args:
            row: of the job.
            shares: part of the time that goes into each stage.
        """
        self.id: str = row["id"]
        self.timings_of: Callable[[], Mapping[str, float]] = dict[str, float]
        """Asked for the seconds spent, once there is somebody to ask."""
        self._shares = shares
        self._done: dict[str, float] = {}
        self._lock = threading.Lock()
        self._cancelled: float | None = None
        self._postponed = False
        self._news: dict[str, Any] = {}
        self._fraction: float = row["fraction"]
        self._log: list[str] = list(row["log"])
        self._summary: dict[str, Any] = dict(row["summary"])

    def progress(self, stage: str, fraction: float) -> None:
        """Note it.

        Raises:
            JobCancelled: the job is not wanted any more.
            JobPostponed: another job comes first.
        """
        self.check_wanted()
        self._done[stage] = min(max(float(fraction), 0.0), 1.0)
        whole = sum(self._shares.values())
        done = sum(share * self._done.get(name, 0.0) for name, share in self._shares.items())
        with self._lock:
            self._fraction = max(self._fraction, done / whole)
            self._news |= {"stage": stage, "fraction": round(self._fraction, 4)}
            self._news["timings"] = dict(self.timings_of())

    def say(self, sentence: str) -> None:
        """Add a sentence to the log."""
        with self._lock:
            self._log = [*self._log, sentence][-LONGEST_LOG:]
            self._news["log"] = self._log

    def tell(self, about: Mapping[str, Any]) -> None:
        """Add to the summary."""
        with self._lock:
            self._summary = {**self._summary, **about}
            self._news["summary"] = self._summary

    def check_wanted(self) -> None:
        """Stop here if nobody wants the job any more, or not now.

        Raises:
            JobCancelled: nobody wants it.
            JobPostponed: another job comes first.
        """
        if self._cancelled is not None:
            raise JobCancelled
        if self._postponed:
            raise JobPostponed

    def cancel(self) -> None:
        """The next progress stops the job."""
        if self._cancelled is None:
            self._cancelled = time.monotonic()

    def postpone(self) -> None:
        """The next progress stops the job, which is done later."""
        self._postponed = True

    @property
    def unwanted(self) -> float:
        """Seconds since it was cancelled; 0 if it was not."""
        return 0.0 if self._cancelled is None else time.monotonic() - self._cancelled

    def news(self) -> dict[str, Any]:
        """Values of columns that were not written yet."""
        with self._lock:
            news, self._news = self._news, {}
        return news


_log = logging.getLogger(__name__)


class JobLost(Exception):
    """The job is not this worker's any more."""


class ClaimedJob:
    """One attempt at one job. It is over in the tables only when nothing is left of it on the disk."""

    def __init__(
        self, store: WorkerStore, row: Mapping[str, Any], kinds: Mapping[str, JobKind]
    ) -> None:
        """`row` was claimed by this worker."""
        self._store, self._row = store, row
        self._kind = kinds.get(row["kind"])
        self._reporter = JobReporter(row, self._kind.shares if self._kind else {})
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
        self._reporter.timings_of = lambda: work.timings
        self._reporter.say(f"Attempt {self._row['attempts']}, on {socket.gethostname()}.")
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
            state = self._store.write(self._row["id"], self._reporter.news())
        if state == "cancelling":
            self._reporter.cancel()
        return 0.0 if self._ending else self._reporter.unwanted

    def let_others_first(self) -> None:
        """Put the job back into the queue soon, where another one is waited for; for another thread."""
        if self._waited_for is None:  # asked in the job's own thread, DBOS would note it as a step
            self._waited_for = waited_for(self._row["workflow"])
        if not self._waited_for and not self._ending and others_waited_for():
            self._reporter.postpone()

    def _begin(self) -> StagedJob | None:
        """The job as it is now, or None when it was over before it began."""
        row, kind = self._row, self._kind
        if kind is None:
            self._fail(_unknown(row["kind"]), None)
            return None
        reporter = self._reporter
        attempt = Attempt(
            row["id"], reporter.progress, reporter.say, reporter.tell, row["timings"], self._follow
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
        queue = JobQueue(self._store.database)
        try:
            if not queue.submit_all([(job_id, order)], waited_for=False):
                queue.again(job_id)  # of an earlier result in the same place
        finally:
            queue.let_go()
        return job_id

    def _do(self, stage: Callable[[], None], work: StagedJob) -> bool:
        """One stage; whether to go on."""
        try:
            self._reporter.check_wanted()
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
        self._store.write(self._row["id"], {"inputs": _hashed(self._row["inputs"])})

    def _fail(self, error: JobError, work: StagedJob | None) -> None:
        self._ending = True
        # Written before the cleaning, so that whoever finds it half cleaned knows why.
        self._store.write(self._row["id"], {"error": error.model_dump()})
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
        queue = JobQueue(self._store.database)
        try:
            with self._writing:
                self._reporter.news()
                queue.postpone(self._row["id"], self._store.worker)
        finally:
            queue.let_go()

    def _end(self, state: Any, values: Mapping[str, Any]) -> None:
        with self._writing:
            news = {**self._reporter.news(), **values}
            if not self._store.end(self._row["id"], state, news):
                raise JobLost

    def _check_ours(self) -> None:
        """Check that the job is still ours: who lost it may see its folder vanish."""
        if self._store.write(self._row["id"], {}) is None:
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
    """Refuse inputs that changed since an earlier attempt: the two are not mixed."""
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
