"""A result becomes a file of another program."""

from capture_app.jobs.kinds.file import FileWork
from capture_app.jobs.orders import ExportOrder
from capture_app.jobs.work import Attempt, Kind


def _start(order: ExportOrder, attempt: Attempt) -> FileWork:
    from capture_app.exports.bone_names import Bones
    from capture_app.exports.export import ExportOptions, object_file
    from capture_app.exports.formats import Kind as Format
    from capture_app.exports.of_result import export_result

    options = ExportOptions(
        kind=Format(order.to),
        fps=float(order.fps),
        up=order.up,
        units=order.units,
        bones=Bones(order.bones),
        skeleton=order.skeleton,
    )

    def write() -> None:
        attempt.progress("export", 0.0)
        written = export_result(order.result, order.output, order.sample, options)
        attempt.progress("export", 1.0)
        for note in written.notes:
            attempt.say(note)
        attempt.tell({"files": [path.name for path in written.files]})

    return FileWork("export", write, [order.output, object_file(order.output)])


KIND = Kind(ExportOrder, _start, {"export": 1.0})
