"""A result becomes a video or a picture."""

from capture_app.jobs.kinds.file import FileWork
from capture_app.jobs.orders import RenderOrder
from capture_app.jobs.work import Attempt, Kind


def _start(order: RenderOrder, attempt: Attempt) -> FileWork:
    from capture_app.rendering import RenderRequest, render_result

    request = RenderRequest(
        order.result,
        order.output,
        view=order.view,
        sample=order.sample,
        size=order.size,
        still=order.still,
        sheet=order.sheet,
        markers=order.markers,
        smooth=order.smooth,
    )
    return FileWork("video", lambda: render_result(request, attempt.progress), [order.output])


KIND = Kind(RenderOrder, _start, {"video": 1.0})
