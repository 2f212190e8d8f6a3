"""A result with corrected contacts becomes another one."""

from capture_app.commands.run import ResolveRequest
from capture_app.jobs.kinds.folder import FolderWork
from capture_app.jobs.work import Attempt, Kind


def _start(order: ResolveRequest, attempt: Attempt) -> FolderWork:
    from capture_app.resolve import CorrectionInMaking

    making = CorrectionInMaking(order, attempt.progress, key=attempt.id, timings=attempt.timings)
    return FolderWork(making, attempt)


KIND = Kind(ResolveRequest, _start, {"read": 0.1, "solve": 0.4, "export": 0.1, "video": 0.4})
