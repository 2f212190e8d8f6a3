"""A short kind of job that tells afterwards whether it was done once, and whole."""

import errno
import os
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import ClassVar

from capture_app.commands.request import Request
from capture_app.jobs.job_kinds import Attempt, JobKind
from capture_app.jobs.worker_store import DEADLIEST
from capture_app.staging import Staging
from omomo_core.errors import InputError

STEPS = ("first", "second", "third")


class StandInOrder(Request):
    KIND: ClassVar[str] = "stand-in"
    READS: ClassVar[tuple[str, ...]] = ("source",)

    source: Path | None = None
    seconds: float = 0.02
    """Of each stage."""
    fault: str = ""
    """What the second stage does: "input", "defect", "memory", "full" disk, "kill" its worker, or "deaf".
    "late": the last stage kills the first workers after the result is in place, until the job is given up."""


class StandIn:
    def __init__(self, order: StandInOrder, attempt: Attempt) -> None:
        self._order, self._attempt = order, attempt
        self._staging = Staging(order.output, key=attempt.id)
        self.timings: Mapping[str, float] = {}

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        stages = {name: (lambda name=name: self._write(name)) for name in STEPS}
        return {**stages, "finish": self._finish}

    def settle(self) -> None:
        if self._staging.folder.exists():
            self._staging.flush()

    def discard(self) -> None:
        self._staging.discard()

    def _write(self, name: str) -> None:
        folder = self._staging.open()
        with (folder / "stages.txt").open("a") as file:
            file.write(f"{name}\n")
        if name == "second":
            self._misbehave()
        begin = time.monotonic()
        while (spent := time.monotonic() - begin) < self._order.seconds:
            self._attempt.progress(name, spent / self._order.seconds)
            time.sleep(min(0.01, self._order.seconds))
        self._attempt.progress(name, 1.0)

    def _misbehave(self) -> None:
        if self._order.fault == "input":
            raise InputError("made-up", "It is wrong.", where="here", fix="Mend it.")
        if self._order.fault == "defect":
            raise KeyError("secret")
        if self._order.fault == "memory":
            raise MemoryError
        if self._order.fault == "full":
            raise OSError(errno.ENOSPC, "No space left on device")
        if self._order.fault == "deaf":
            time.sleep(60.0)
        if self._order.fault == "kill":
            os.kill(os.getpid(), signal.SIGKILL)

    def _die_late(self) -> None:
        deaths = self._order.output.with_suffix(".deaths")
        with deaths.open("a") as file:
            file.write("x")
        if deaths.stat().st_size <= DEADLIEST:
            os.kill(os.getpid(), signal.SIGKILL)

    def _finish(self) -> None:
        if self._staging.folder.exists():
            (self._staging.folder / "manifest.json").write_text("{}")
        self._staging.publish()
        if self._order.fault == "late":
            self._die_late()
        # Counts how often the last stage ran to its end: twice only when it was killed after that.
        self._attempt.tell({"made": self._order.output.name})


KIND = JobKind(StandInOrder, StandIn, dict.fromkeys(STEPS, 1.0))
