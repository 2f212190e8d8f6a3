"""The one record of a job, for the page, the API and the batch, and why it failed."""

import errno
from datetime import datetime
from typing import Any, Literal

from pydantic import ConfigDict

from capture_app.commands.inputs import DescribedModel
from omomo_core.errors import OmocapError

State = Literal["queued", "running", "cancelling", "cancelled", "done", "failed"]
OVER: tuple[State, ...] = ("cancelled", "done", "failed")
"""States that a job does not leave by itself."""

LONGEST_LOG = 200
"""Sentences."""


class _Frozen(DescribedModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class JobInput(_Frozen):
    """A file or folder that a job reads."""

    role: str
    """What it is to the job, such as "session"."""
    path: str
    """Its path; over HTTP its name in the library."""
    sha256: str | None = None
    """Checksum of its content; not given before the job has read it."""


class JobError(_Frozen):
    """Why a job failed, in words; a defect's trace is in the worker's log."""

    code: str
    """Stays the same in all versions, such as "mesh-unreadable"."""
    what: str
    """What is wrong, in a sentence."""
    where: str = ""
    """The file, option or frames; "" where that is no place."""
    fix: str = ""
    """How to fix it; "" where no remedy is sure."""

    @classmethod
    def of(cls, error: OmocapError) -> "JobError":
        """The same, from an exception."""
        return cls(code=error.code, what=error.what, where=error.where, fix=error.fix)


class JobRecord(_Frozen):
    """What is known about a job."""

    id: str
    """16 lower-case hex digits."""
    kind: str
    """What is ordered, such as "run"."""
    name: str
    """Name that its owner gave it."""
    state: State
    """How it is going; it stays cancelled, done or failed."""
    stage: str
    """What it is at, e.g. "solve"; the last thing it was at when it is over."""
    fraction: float
    """Fraction of the whole job, 0 to 1."""
    log: tuple[str, ...]
    """What happened, in sentences; the latest 200."""
    timings: dict[str, float]
    """Seconds spent in each stage."""
    inputs: tuple[JobInput, ...]
    """What it reads."""
    options: dict[str, Any]
    """What was ordered, apart from inputs and output."""
    output: str | None
    """Path of the file or folder that it makes."""
    summary: dict[str, Any]
    """What its kind tells of the outcome: a run its verdict on the take and its scores."""
    error: JobError | None
    """Why it failed; null unless it has."""
    attempts: int
    """How often a worker began or went on with it."""
    created: datetime
    """When it was ordered, UTC."""
    started: datetime | None
    """When a worker first began with it, UTC."""
    ended: datetime | None
    """When it was over, UTC."""


FULL = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of an OSError where the disk has no room."""
_MEMORY = ("MemoryError", "OutOfMemoryError", "ArrayMemoryError")
"""Names of the memory errors of Python, of torch on a GPU, of numpy."""


def no_room(error: BaseException) -> bool:
    """Whether there was no room on a disk, of whatever room of the program or of the database."""
    if isinstance(error, OmocapError):
        return error.code == "disk-full"
    return (isinstance(error, OSError) and error.errno in FULL) or "disk is full" in str(error)


def job_error(error: Exception) -> JobError:
    """Return what to say of an exception; of a defect that it is one, and no more."""
    if isinstance(error, OmocapError):
        return JobError.of(error)
    if type(error).__name__.strip("_") in _MEMORY:
        return JobError(
            code="out-of-memory",
            what="The machine's memory is too small for this job.",
            fix="Order fewer samples or a smaller video, cut the take into shorter ones, or close "
            "other programs.",
        )
    if no_room(error):
        return JobError(
            code="disk-full",
            what="There is no room left on the disk.",
            where=str(getattr(error, "filename", None) or ""),
            fix="Make room, and order the job again.",
        )
    return JobError(
        code="defect",
        what=f"This is a defect of omocap: {type(error).__name__}.",
        fix="Report it, with what the worker's log says of this job.",
    )
