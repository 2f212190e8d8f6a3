"""Looking at many jobs until they are over."""

import time
from collections.abc import Callable, Sequence

from capture_app.jobs.queue import JobQueue
from capture_app.jobs.record import OVER, JobRecord

Shown = Callable[[Sequence[JobRecord], Sequence[JobRecord]], None]
"""Given the jobs that have ended since the last time, and those that run."""


def watch(queue: JobQueue, ids: Sequence[str], show: Shown, *, pause: float = 1.0) -> None:
    """Return when all jobs are over; they are over whoever does them.

    Args:
        queue: they are in.
        ids: of the jobs.
        show: told what is new.
        pause: seconds between looks.
    """
    left = list(ids)
    while True:
        now = queue.get_all(left)
        ended = [job for job in now if job.state in OVER]
        left = [job.id for job in now if job.state not in OVER]
        show(ended, [job for job in now if job.state in ("running", "cancelling")])
        if not left:
            return
        time.sleep(pause)
