"""Several motions side by side."""

from capture_app.jobs.kinds.file import FileWork
from capture_app.jobs.orders import CompareOrder
from capture_app.jobs.work import Attempt, Kind


def _start(order: CompareOrder, attempt: Attempt) -> FileWork:
    from capture_app.comparison.film import CompareRequest, compare_motions

    request = CompareRequest(
        order.motions,
        order.output,
        samples=order.samples,
        paper_rule=order.rule is not None,
        heat=order.heat,
        any_object=order.any_object,
        labels=order.labels,
        size=order.size,
        columns=order.columns,
        still=order.still,
        sheet=order.sheet,
        figures=order.figures,
        markers=order.markers,
        smooth=order.smooth,
    )

    def write() -> None:
        made = compare_motions(request, attempt.progress)
        for note in made.notes:
            attempt.say(note)

    files = [order.output, *([order.figures] if order.figures else [])]
    return FileWork("video", write, files)


KIND = Kind(CompareOrder, _start, {"read": 0.1, "video": 0.9})
