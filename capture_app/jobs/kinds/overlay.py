"""A result drawn into a film of the take."""

from capture_app.commands.overlay import OverlayRequest
from capture_app.jobs.kinds.file import FileJob
from capture_app.jobs.protocol import Attempt, JobKind


def _start(order: OverlayRequest, attempt: Attempt) -> FileJob:
    from capture_app.overlay.write import overlay_result

    def write() -> None:
        made = overlay_result(order, attempt.progress)
        for note in made.notes:
            attempt.say(note)
        if made.offset is not None:
            attempt.tell({"offset": round(made.offset, 3)})

    return FileJob("video", write, [order.output])


KIND = JobKind(OverlayRequest, _start, {"board": 0.3, "localise": 0.1, "video": 0.6})
