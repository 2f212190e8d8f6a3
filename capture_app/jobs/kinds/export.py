"""A result becomes a file of another program."""

from capture_app.commands.export import ExportRequest
from capture_app.jobs.kinds.file import FileJob
from capture_app.jobs.protocol import Attempt, JobKind


def _start(request: ExportRequest, attempt: Attempt) -> FileJob:
    from capture_app.exports.export import object_file
    from capture_app.exports.of_result import export_result

    def write() -> None:
        attempt.progress("export", 0.0)
        written = export_result(request)
        attempt.progress("export", 1.0)
        for note in written.notes:
            attempt.say(note)
        attempt.tell({"files": [path.name for path in written.files]})

    return FileJob("export", write, [request.output, object_file(request.output)])


KIND = JobKind(ExportRequest, _start, {"export": 1.0})
