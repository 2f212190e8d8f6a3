"""The one record of a job, for the page, the API and the batch."""

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from omomo_core.errors import OmocapError

State = Literal["queued", "running", "cancelling", "cancelled", "done", "failed"]
OVER: tuple[State, ...] = ("cancelled", "done", "failed")
"""States that a job does not leave by itself."""

LONGEST_LOG = 200
"""Sentences."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class JobInput(_Frozen):
    """A file or folder that a job reads."""

    role: str
    path: str
    sha256: str | None = None
    """Known once the job has read it."""


class JobError(_Frozen):
    """Why a job failed, in words; a defect's trace is in the worker's log."""

    code: str
    what: str
    where: str = ""
    fix: str = ""

    @classmethod
    def of(cls, error: OmocapError) -> "JobError":
        """The same, from an exception."""
        return cls(code=error.code, what=error.what, where=error.where, fix=error.fix)


class JobRecord(_Frozen):
    """What is known about a job."""

    id: str
    """16 lower-case hex digits."""
    kind: str
    name: str
    """As its owner calls it."""
    state: State
    stage: str
    """What it is at, e.g. "solve"; the last thing it was at when it is over."""
    fraction: float
    """Of the whole job, 0 to 1."""
    log: tuple[str, ...]
    """What happened, in sentences; the latest 200."""
    timings: dict[str, float]
    """Seconds spent in each stage."""
    inputs: tuple[JobInput, ...]
    options: dict[str, Any]
    """What was ordered, apart from inputs and output."""
    output: str | None
    """Path of the file or folder that it makes."""
    summary: dict[str, Any]
    """What its kind tells of the outcome: a run its verdict on the take and its scores."""
    error: JobError | None
    attempts: int
    """How often a worker began or went on with it."""
    created: datetime
    started: datetime | None
    ended: datetime | None
