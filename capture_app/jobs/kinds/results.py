"""Jobs that make a result folder, stage by stage: a run, and a run with corrected contacts.

The video is a job of its own, which the last stage orders, and the poster is drawn when a list of results is
looked at: a result waits for no picture.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.jobs.protocol import Attempt, JobKind

if TYPE_CHECKING:
    from capture_app.manifest import Manifest
    from capture_app.pipeline import StagedRun
    from capture_app.staged_result import StagedResult


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
        """As the manifest has them."""
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
        for sentence in (*manifest.notes, *manifest.faults):
            self._attempt.say(sentence)
        if video := self.staged.request.video:
            self._attempt.tell({"video_job": self._attempt.follow(video)})
        self._attempt.tell(summary_of(manifest))


def summary_of(manifest: "Manifest") -> dict[str, Any]:
    """What a job tells of the result that it made."""
    chosen = manifest.chosen
    return {"sample": chosen + 1, "scores": manifest.scores[chosen]}


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
