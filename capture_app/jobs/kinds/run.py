"""A take becomes a motion."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from capture_app.commands.run import RunRequest
from capture_app.jobs.kinds.folder import FolderJob
from capture_app.jobs.protocol import Attempt, JobKind

if TYPE_CHECKING:
    from capture_app.pipeline import StagedRun

_SHARES = {
    "read": 0.05,
    "object": 0.02,
    "hands": 0.1,
    "contact": 0.03,
    "body": 0.15,
    "solve": 0.3,
    "export": 0.05,
    "video": 0.3,
}


class _TakeWork(FolderJob):
    """Also tells the verdict on the take."""

    def __init__(self, staged: "StagedRun", attempt: Attempt) -> None:
        super().__init__(staged, attempt)
        self._take = staged

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        return {**super().stages, "read": self._read}

    def _read(self) -> None:
        self._take.read()
        self._attempt.tell({"verdict": self._take.prepared.verdict})


def _start(order: RunRequest, attempt: Attempt) -> FolderJob:
    from capture_app.pipeline import StagedRun

    staged = StagedRun(order, attempt.progress, key=attempt.id, timings=attempt.timings)
    return _TakeWork(staged, attempt)


KIND = JobKind(RunRequest, _start, _SHARES)
