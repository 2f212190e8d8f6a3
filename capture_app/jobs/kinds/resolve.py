"""A result with corrected contacts becomes another one."""

from capture_app.commands.run import ResolveRequest
from capture_app.jobs.kinds.folder import FolderJob
from capture_app.jobs.protocol import Attempt, JobKind


def _start(order: ResolveRequest, attempt: Attempt) -> FolderJob:
    from capture_app.resolve import StagedCorrection

    staged = StagedCorrection(order, attempt.progress, key=attempt.id, timings=attempt.timings)
    return FolderJob(staged, attempt)


KIND = JobKind(ResolveRequest, _start, {"read": 0.1, "solve": 0.4, "export": 0.1, "video": 0.4})
