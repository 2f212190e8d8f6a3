"""A result becomes a video or a picture."""

from capture_app.commands.render import RenderRequest
from capture_app.jobs.kinds.file import FileJob
from capture_app.jobs.protocol import Attempt, JobKind


def _start(order: RenderRequest, attempt: Attempt) -> FileJob:
    from capture_app.rendering import render_result

    return FileJob("video", lambda: render_result(order, attempt.progress), [order.output])


KIND = JobKind(RenderRequest, _start, {"video": 1.0})
