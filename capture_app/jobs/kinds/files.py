"""Jobs that make files in one go: a video, a picture, or a file of another program."""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from capture_app.commands.export import ExportRequest
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import CompareRequest, RenderRequest
from capture_app.jobs.protocol import Attempt, JobKind
from omomo_core.whole_file import partial_of


class FileJob:
    """One stage; its files appear whole or not at all."""

    def __init__(self, stage: str, write: Callable[[], None], files: Sequence[Path]) -> None:
        """Nothing is read yet.

        Args:
            stage: its name.
            write: does it all.
            files: what it writes.
        """
        self._stage, self._write, self._files = stage, write, files
        self._begin = time.perf_counter()

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """The one."""
        return {self._stage: self._write}

    @property
    def timings(self) -> Mapping[str, float]:
        """Of this attempt, which does everything again."""
        return {self._stage: round(time.perf_counter() - self._begin, 3)}

    def settle(self) -> None:
        """Files are flushed before they get their names."""

    def discard(self) -> None:
        """Remove what a killed attempt left."""
        for file in self._files:
            partial_of(file).unlink(missing_ok=True)


def _start_render(order: RenderRequest, attempt: Attempt) -> FileJob:
    from capture_app.rendering import render_result

    return FileJob("video", lambda: render_result(order, attempt.progress), [order.output])


RENDER = JobKind(RenderRequest, _start_render, {"video": 1.0})


def _start_export(request: ExportRequest, attempt: Attempt) -> FileJob:
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


EXPORT = JobKind(ExportRequest, _start_export, {"export": 1.0})


def _start_overlay(order: OverlayRequest, attempt: Attempt) -> FileJob:
    from capture_app.overlay.write import overlay_result

    def write() -> None:
        made = overlay_result(order, attempt.progress)
        for note in made.notes:
            attempt.say(note)
        if made.offset is not None:
            attempt.tell({"offset": round(made.offset, 3)})

    return FileJob("video", write, [order.output])


OVERLAY = JobKind(OverlayRequest, _start_overlay, {"board": 0.3, "localise": 0.1, "video": 0.6})


def _start_compare(order: CompareRequest, attempt: Attempt) -> FileJob:
    from capture_app.comparison.film import compare_motions

    def write() -> None:
        made = compare_motions(order, attempt.progress)
        for note in made.notes:
            attempt.say(note)

    files = [order.output, *([order.figures] if order.figures else [])]
    return FileJob("video", write, files)


COMPARE = JobKind(CompareRequest, _start_compare, {"read": 0.1, "video": 0.9})
