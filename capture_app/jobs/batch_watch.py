"""Looking at many jobs until they are over."""

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from capture_app.jobs.job_record import OVER, JobRecord
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from capture_app.jobs.queue import JobQueue

Shown = Callable[[Sequence[JobRecord], Sequence[JobRecord]], None]
"""Given the jobs that have ended since the last time, and those that run."""


def watch(
    queue: "JobQueue",
    ids: Sequence[str],
    show: Shown,
    *,
    pause: float = 1.0,
    full: Callable[[], bool] = lambda: False,
) -> None:
    """Return when all jobs and the videos they ordered are over, whoever does them.

    Args:
        queue: they are in.
        ids: of the jobs.
        show: called with what is new.
        pause: seconds between looks.
        full: whether the workers cannot even tell what became of their jobs, because the disk is full.

    Raises:
        InputError: "disk-full": no job that is left can be done, and what failed for it may be done later.
    """
    asked, unfinished = set(ids), list(ids)
    while True:
        now = queue.get_all(unfinished)
        ended = [job for job in now if job.state in OVER]
        unfinished = [job.id for job in now if job.state not in OVER]
        unfinished += videos_of(ended)
        show(
            [job for job in ended if job.id in asked],
            [job for job in now if job.state in ("running", "cancelling")],
        )
        if full() or any(job.error and job.error.code == "disk-full" for job in ended):
            raise _full(len(unfinished) + sum(job.state != "done" for job in ended))
        if not unfinished:
            return
        time.sleep(pause)


def videos_of(jobs: Sequence[JobRecord]) -> list[str]:
    """Ids of the jobs that draw their videos."""
    return [job.summary["video_job"] for job in jobs if job.summary.get("video_job")]


def _full(unfinished: int) -> InputError:
    return InputError(
        "disk-full",
        f"The disk is full; {unfinished} sessions are not done.",
        fix="Make room on it and give the same command again: what is done stays, and the rest goes on.",
    )
