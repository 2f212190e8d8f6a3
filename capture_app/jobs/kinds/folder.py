"""Jobs that make a result folder, stage by stage."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from capture_app.jobs.protocol import Attempt

if TYPE_CHECKING:
    from capture_app.manifest import Manifest
    from capture_app.staged_result import StagedResult


class FolderJob:
    """A result in the making, as a job."""

    def __init__(self, staged: "StagedResult[Any]", attempt: Attempt) -> None:
        """Nothing is read yet."""
        self.staged = staged
        self._attempt = attempt

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Those of the result, and its poster; the last one tells what came out."""
        stages = {name: stage for name, stage in self.staged.stages.items() if name != "finish"}
        return {**stages, "poster": self._poster, "finish": self._finish}

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

    def _poster(self) -> None:
        from capture_app.posters import POSTER, person_poster

        staged = self.staged
        path = staged.staging.folder / POSTER
        person_poster(path, staged.sample.person, staged.object_motion, staged.body)

    def _finish(self) -> None:
        from capture_app.manifest import MANIFEST, read_manifest

        self.staged.finish()
        manifest = read_manifest(self.staged.staging.target / MANIFEST)
        for sentence in (*manifest.notes, *manifest.faults):
            self._attempt.say(sentence)
        self._attempt.tell(summary_of(manifest))


def summary_of(manifest: "Manifest") -> dict[str, Any]:
    """What a job tells of the result that it made."""
    chosen = manifest.chosen
    return {"sample": chosen + 1, "scores": manifest.scores[chosen]}
