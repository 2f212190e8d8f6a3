"""A job at work: what a kind of job has to offer, and what it may say meanwhile."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from capture_app.commands.request import Request
from capture_app.progress import Progress


@dataclass(frozen=True)
class Attempt:
    """One go at a job, by one worker; it may be the continuation of an earlier one's."""

    id: str
    """Of the job."""
    progress: Progress
    """To be told often; raises when the job is cancelled."""
    say: Callable[[str], None]
    """Takes a sentence for the log."""
    tell: Callable[[Mapping[str, Any]], None]
    """Takes what belongs into the summary."""
    timings: Mapping[str, float] = field(default_factory=dict[str, float])
    """Seconds spent by earlier attempts."""
    follow: Callable[[Request], str] = lambda order: ""
    """Puts another job into the queue, behind all that people wait for; returns its id, which is
    the same for the same order."""


class StagedJob(Protocol):
    """A job in this process. Nothing is read when it is made."""

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """In their order. Each may be run again, and may find what another process left."""
        ...

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds spent in each stage of the progress, earlier attempts' too."""
        ...

    def settle(self) -> None:
        """What was made so far survives a power cut; called after each stage."""
        ...

    def discard(self) -> None:
        """Leave nothing behind of a job that is not done."""
        ...


@dataclass(frozen=True)
class JobKind:
    """A kind of job."""

    order: type[Request]
    start: Callable[[Any, Attempt], StagedJob]
    """From an order of that type; what it needs is imported inside."""
    shares: Mapping[str, float]
    """About which part of the time goes into each stage of the progress."""
