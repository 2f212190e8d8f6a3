"""A result becomes a video or a picture."""

from capture_app.commands.render import RenderRequest
from capture_app.jobs.kinds.file import FileWork
from capture_app.jobs.work import Attempt, Kind


def _start(order: RenderRequest, attempt: Attempt) -> FileWork:
    from capture_app.rendering import render_result

    return FileWork("video", lambda: render_result(order, attempt.progress), [order.output])


KIND = Kind(RenderRequest, _start, {"video": 1.0})
