"""A result with corrected contacts becomes another one."""

from capture_app.jobs.kinds.folder import FolderWork
from capture_app.jobs.orders import ResolveOrder
from capture_app.jobs.work import Attempt, Kind


def _start(order: ResolveOrder, attempt: Attempt) -> FolderWork:
    from capture_app.request import ResolveRequest
    from capture_app.resolve import CorrectionInMaking

    request = ResolveRequest(
        order.result,
        order.contacts,
        order.output,
        video_size=order.video_size,
        replace=order.replace,
    )
    making = CorrectionInMaking(request, attempt.progress, key=attempt.id, timings=attempt.timings)
    return FolderWork(making, attempt)


KIND = Kind(ResolveOrder, _start, {"read": 0.1, "solve": 0.4, "export": 0.1, "video": 0.4})
