"""What a worker has on its desk: one job, seen by the thread that does it and the one that reports."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from capture_app.jobs.record import LONGEST_LOG


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
