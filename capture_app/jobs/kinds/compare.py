"""Several motions side by side."""

from capture_app.commands.render import CompareRequest
from capture_app.jobs.kinds.file import FileWork
from capture_app.jobs.work import Attempt, Kind


def _start(order: CompareRequest, attempt: Attempt) -> FileWork:
    from capture_app.comparison.film import compare_motions

    def write() -> None:
        made = compare_motions(order, attempt.progress)
        for note in made.notes:
            attempt.say(note)

    files = [order.output, *([order.figures] if order.figures else [])]
    return FileWork("video", write, files)


KIND = Kind(CompareRequest, _start, {"read": 0.1, "video": 0.9})
