"""The kinds of jobs: what each does stage by stage, and what a kind has to offer.

The video is a job of its own, which the last stage orders, and the poster is drawn when a list of results is
looked at: a result waits for no picture.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from capture_app.commands.calibrate import CalibrateRequest
from capture_app.commands.export import ExportRequest
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import CompareRequest, RenderRequest
from capture_app.commands.request import ItemRequest, Request
from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.commands.scan import ScanRequest
from capture_app.library_item import FILES, INFO, PICTURE, info_of, save_info
from capture_app.progress import Progress, StageClock
from capture_app.staging import Staging
from omomo_core.whole_file import partial_of

if TYPE_CHECKING:
    from capture_app.manifest import Manifest
    from capture_app.pipeline import StagedRun
    from capture_app.staged_result import StagedResult


@dataclass(frozen=True)
class Attempt:
    """One go at a job, by one worker; it may be the continuation of an earlier one's."""

    id: str
    """Id of the job."""
    progress: Progress
    """To be told often; raises when the job is cancelled."""
    say: Callable[[str], None]
    """Takes a sentence for the log."""
    tell: Callable[[Mapping[str, Any]], None]
    """Takes what belongs into the summary."""
    timings: Mapping[str, float] = field(default_factory=dict[str, float])
    """Seconds spent by earlier attempts."""
    follow: Callable[[Request], str] = lambda order: ""
    """Puts another job into the queue, behind all that people wait for; returns its id, which is
    the same for the same order."""


class StagedJob(Protocol):
    """A job in this process. Nothing is read when it is made."""

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """In their order. Each may be run again, and may find what another process left."""
        ...

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds spent in each stage of the progress, earlier attempts' too."""
        ...

    def settle(self) -> None:
        """What was made so far survives a power cut; called after each stage."""
        ...

    def discard(self) -> None:
        """Leave nothing behind of a job that is not done."""
        ...


@dataclass(frozen=True)
class JobKind:
    """A kind of job."""

    order: type[Request]
    start: Callable[[Any, Attempt], StagedJob]
    """From an order of that type; what it needs is imported inside."""
    shares: Mapping[str, float]
    """About which part of the time goes into each stage of the progress."""


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
        """Seconds of each stage of this attempt, which does everything again."""
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
    from capture_app.exports.export_sample import contacts_file, export_result, object_file

    def write() -> None:
        attempt.progress("export", 0.0)
        written = export_result(request)
        attempt.progress("export", 1.0)
        for note in written.notes:
            attempt.say(note)
        attempt.tell({"files": [path.name for path in written.files], "notes": list(written.notes)})

    made = [request.output, object_file(request.output), contacts_file(request.output)]
    return FileJob("export", write, made)


EXPORT = JobKind(ExportRequest, _start_export, {"export": 1.0})


def _start_overlay(order: OverlayRequest, attempt: Attempt) -> FileJob:
    from capture_app.overlay.find_camera import overlay_result

    def write() -> None:
        made = overlay_result(order, attempt.progress, attempt.say)
        for note in made.notes:
            attempt.say(note)
        if made.offset is not None:
            attempt.tell({"offset": round(made.offset, 3)})

    return FileJob("video", write, [order.output])


OVERLAY = JobKind(OverlayRequest, _start_overlay, {"board": 0.3, "localise": 0.1, "video": 0.6})


def _start_compare(order: CompareRequest, attempt: Attempt) -> FileJob:
    from capture_app.comparison.comparison_film import compare_motions

    def write() -> None:
        made = compare_motions(order, attempt.progress)
        for note in made.notes:
            attempt.say(note)

    files = [order.output, *([order.figures] if order.figures else [])]
    return FileJob("video", write, files)


COMPARE = JobKind(CompareRequest, _start_compare, {"read": 0.1, "video": 0.9})


Make = Callable[[Path, Progress], dict[str, Any]]
"""Given the folder of the thing, whose `files` are there, fills it; returns facts about it."""


class ItemJob:
    """A thing in the making; what an earlier attempt left in its folder may be gone on with."""

    def __init__(self, order: ItemRequest, attempt: Attempt, make: Make) -> None:
        """Nothing is read yet."""
        self._order, self._attempt, self._fill = order, attempt, make
        self._staging = Staging(order.output, key=attempt.id)
        self._clock = StageClock(attempt.progress, attempt.timings)

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Make it, put it in its place."""
        return {"make": self._make, "finish": self._staging.publish}

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds of each stage of the progress."""
        return self._clock.seconds

    def settle(self) -> None:
        """Flush the folder; it is flushed already when it has its name."""
        if self._staging.folder.exists():
            self._staging.flush()

    def discard(self) -> None:
        """Remove the folder."""
        self._staging.discard()

    def _make(self) -> None:
        folder = self._staging.open()
        (folder / FILES).mkdir(exist_ok=True)
        facts = {**self._order.facts, **self._fill(folder, self._clock)}
        save_info(folder / INFO, info_of(self._order.name, folder / FILES, facts))
        self._attempt.tell(facts)


MESH = "object.glb"
_SCAN_SHARES = {
    "look": 0.03,
    "frames": 0.05,
    "features": 0.1,
    "compare": 0.05,
    "match": 0.1,
    "cameras": 0.15,
    "stereo": 0.25,
    "silhouettes": 0.05,
    "fusion": 0.1,
    "colours": 0.04,
    "clean": 0.04,
    "texture": 0.04,
    "report": 0.04,
}


def _start_scan(order: ScanRequest, attempt: Attempt) -> ItemJob:
    from capture_app.library_item import mesh_summary
    from capture_app.posters import object_poster
    from capture_app.scanning.scan_object import scan_object
    from ingest.mesh import load_mesh
    from ingest.report.take_inspection import REPORT_DATA

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        # What an earlier attempt wrote is not in the way of this one.
        update = {"output": folder / FILES / MESH, "keep": False, "replace": True}
        request = order.model_copy(update=update)
        scan_object(request, progress)
        object_poster(folder / PICTURE, load_mesh(request.output))
        report = json.loads((request.work / REPORT_DATA).read_text(encoding="utf-8"))
        return {
            "mesh": MESH,
            **mesh_summary(request.output, 1.0),
            "scan": {"severity": report["severity"], "checks": report["checks"]},
        }

    return ItemJob(order, attempt, make)


SCAN = JobKind(ScanRequest, _start_scan, _SCAN_SHARES)


def _start_calibrate(order: CalibrateRequest, attempt: Attempt) -> ItemJob:
    from capture_app.calibration.calibrate import calibrate
    from capture_app.library_item import mount_summary
    from capture_app.posters import mount_poster

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        path = folder / FILES / "mount.json"
        progress("calibrate", 0.0)
        mount = calibrate(order.way, path, progress, picture=None)
        if (mesh_file := order.way.mesh_file) is not None:
            mount_poster(folder / PICTURE, mount, mesh_file.load(mount.object_scale))
        progress("calibrate", 1.0)
        return mount_summary(path)

    return ItemJob(order, attempt, make)


CALIBRATE = JobKind(
    CalibrateRequest, _start_calibrate, {"board": 0.7, "localise": 0.7, "calibrate": 0.3}
)


class FolderJob:
    """A result in the making, as a job."""

    def __init__(self, staged: "StagedResult[Any]", attempt: Attempt) -> None:
        """Nothing is read yet."""
        self.staged = staged
        self._attempt = attempt

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Those of the result; the last one also tells what came out."""
        return {**self.staged.stages, "finish": self._finish}

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds of each stage, as the manifest has them."""
        return self.staged.clock.seconds

    def settle(self) -> None:
        """Flush the folder; it is flushed already when it has its name."""
        if self.staged.staging.folder.exists():
            self.staged.staging.flush()

    def discard(self) -> None:
        """Remove the folder."""
        self.staged.staging.discard()

    def _finish(self) -> None:
        from capture_app.manifest import MANIFEST, read_manifest

        self.staged.finish()
        manifest = read_manifest(self.staged.staging.target / MANIFEST)
        seen = (finding.sentence for finding in manifest.findings)
        for sentence in (*seen, *manifest.notes, *manifest.faults):
            self._attempt.say(sentence)
        if video := self.staged.request.video:
            self._attempt.tell({"video_job": self._attempt.follow(video)})
        self._attempt.tell(summary_of(manifest))


def summary_of(manifest: "Manifest") -> dict[str, Any]:
    """Return what a job tells of the result that it made."""
    from capture_app.manifest import to_look_at

    chosen = manifest.chosen
    return {
        "sample": chosen + 1,
        "scores": manifest.scores[chosen],
        "look_at": list(to_look_at(manifest)),
    }


_RUN_SHARES = {
    "read": 0.05,
    "object": 0.02,
    "hands": 0.1,
    "contact": 0.03,
    "body": 0.15,
    "solve": 0.3,
    "export": 0.05,
}


class _TakeWork(FolderJob):
    """Also tells the verdict on the take."""

    def __init__(self, staged: "StagedRun", attempt: Attempt) -> None:
        super().__init__(staged, attempt)
        self._take = staged

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        return {**super().stages, "read": self._read}

    def _read(self) -> None:
        self._take.read()
        self._attempt.tell({"verdict": self._take.prepared.verdict})


def _start_run(order: RunRequest, attempt: Attempt) -> FolderJob:
    from capture_app.pipeline import StagedRun

    staged = StagedRun(order, attempt.progress, key=attempt.id, timings=attempt.timings)
    return _TakeWork(staged, attempt)


RUN = JobKind(RunRequest, _start_run, _RUN_SHARES)


def _start_resolve(order: ResolveRequest, attempt: Attempt) -> FolderJob:
    from capture_app.resolve import StagedCorrection

    staged = StagedCorrection(order, attempt.progress, key=attempt.id, timings=attempt.timings)
    return FolderJob(staged, attempt)


RESOLVE = JobKind(ResolveRequest, _start_resolve, {"read": 0.2, "solve": 0.6, "export": 0.2})


KINDS: dict[str, JobKind] = {
    kind.order.KIND: kind
    for kind in (RUN, RESOLVE, RENDER, EXPORT, OVERLAY, COMPARE, CALIBRATE, SCAN)
}
"""Kinds of jobs by the kind of their requests."""
