"""Several motions side by side."""

from capture_app.commands.render import CompareRequest
from capture_app.jobs.kinds.file import FileJob
from capture_app.jobs.protocol import Attempt, JobKind


def _start(order: CompareRequest, attempt: Attempt) -> FileJob:
    from capture_app.comparison.film import compare_motions

    def write() -> None:
        made = compare_motions(order, attempt.progress)
        for note in made.notes:
            attempt.say(note)

    files = [order.output, *([order.figures] if order.figures else [])]
    return FileJob("video", write, files)


KIND = JobKind(CompareRequest, _start, {"read": 0.1, "video": 0.9})
