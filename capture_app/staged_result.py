"""A result in the making: stages that leave files in a folder which appears whole or not at all.

The command line runs them one after the other. A durable job runs each as a step of its own, and
after a crash goes on with the next one, in another process.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Generic, TypeVar

from capture_app.commands.run import ResolveRequest, ResultRequest, RunRequest
from capture_app.exports.glb import write_glb
from capture_app.generated_sample import GeneratedSample, load_sample, save_sample
from capture_app.manifest import CONTACTS, GLB, MANIFEST, Manifest, write_manifest
from capture_app.progress import Progress, StageClock, silent
from capture_app.result import Result, load_result
from capture_app.staging import Staging
from omomo_core.body.model import BodyModel
from omomo_core.contact.contact_file import write_contacts
from omomo_core.motion import ObjectMotion

_SAMPLE_FILE = ".made.npz"
"""What was generated, to the last bit; gone when the result is complete."""


Request = TypeVar("Request", RunRequest, ResolveRequest)


class StagedResult(ABC, Generic[Request]):
    """The folder, the clock, and what was made so far, which the stages share."""

    def __init__(
        self,
        request: Request,
        progress: Progress,
        *,
        key: str | None = None,
        timings: Mapping[str, float] | None = None,
    ) -> None:
        """Nothing is read or made yet.

        Args:
            request: what is asked for.
            progress: told each stage and how far it is.
            key: names the folder in which another process can go on; None for this one alone.
            timings: seconds spent before, where another process began.
        """
        self.request: Request = request
        self.staging = Staging(request.output, replace=request.replace, key=key)
        self.clock = StageClock(progress, timings)

    @property
    @abstractmethod
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """The stages in their order; each may be run again."""

    @property
    @abstractmethod
    def inputs(self) -> Mapping[str, Path]:
        """Files and folders that the result is made from, by role."""

    @property
    @abstractmethod
    def object_motion(self) -> ObjectMotion:
        """The object."""

    @property
    @abstractmethod
    def body(self) -> BodyModel:
        """Whose bones the person moves."""

    @property
    @abstractmethod
    def has_contacts(self) -> bool:
        """Contacts were decided; the published rule has none."""

    @abstractmethod
    def manifest(self, files: tuple[str, ...]) -> Manifest:
        """Return the manifest of the result."""

    @cached_property
    def sample(self) -> GeneratedSample:
        """The sample that was generated, by this process or by one before it."""
        return load_sample(self.staging.folder / _SAMPLE_FILE)

    def keep(self, sample: GeneratedSample) -> None:
        """Remember what was generated, here and in the folder."""
        save_sample(self.staging.folder / _SAMPLE_FILE, sample)
        self.sample = sample

    def export(self) -> None:
        """Write contacts.json and the GLB of the chosen sample."""
        self.clock("export", 0.0)
        folder, person, motion = self.staging.folder, self.sample.person, self.object_motion
        if self.has_contacts:
            write_contacts(folder / CONTACTS, person.segments, len(motion.valid))
        write_glb(folder / GLB, person.human, motion, self.body)
        self.clock("export", 1.0)

    def finish(self) -> None:
        """Write the manifest and put the folder in place; nothing to do where that is done."""
        folder = self.staging.folder
        if folder.exists() and not (folder / MANIFEST).exists():
            names = sorted(path.name for path in folder.iterdir())
            files = tuple(name for name in names if not name.startswith("."))
            write_manifest(folder / MANIFEST, self.manifest(files))
        (folder / _SAMPLE_FILE).unlink(missing_ok=True)
        self.staging.publish()


def run_stages(staged: StagedResult[Request]) -> Result:
    """Run all stages; nothing is left behind when one fails.

    Returns:
        The result, as it is on the disk.
    """
    try:
        for stage in staged.stages.values():
            stage()
    finally:
        staged.staging.discard()
    return load_result(staged.staging.target)


def draw_video(request: ResultRequest, progress: Progress = silent) -> None:
    """Draw the video of a result that stands, if one is asked for.

    Args:
        request: what the result was made from.
        progress: told the stage "video".

    Raises:
        InputError: see `render_result`; the result stays as it is.
    """
    if request.video is not None:
        # It loads readers of films: a third of a second of a run that draws none.
        from capture_app.rendering import render_result

        render_result(request.video, progress)
