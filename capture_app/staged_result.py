"""A result in the making: stages that leave files in a folder which appears whole or not at all.

The command line runs them one after the other. A durable job runs each as a step of its own, and
after a crash goes on with the next one, in another process.
"""

import os
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Generic, TypeVar
from uuid import uuid4

from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.exports.glb import write_glb
from capture_app.generated_sample import GeneratedSample, load_sample, save_sample
from capture_app.manifest import CONTACTS, GLB, MANIFEST, Manifest, write_manifest
from capture_app.progress import Progress, StageClock
from capture_app.result import Result, load_result
from omomo_core.body.model import BodyModel
from omomo_core.contact.contact_file import write_contacts
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMotion
from omomo_core.system import flush

MARK = "manifest.json"
"""A folder that holds this file is one of ours, and may be replaced."""


class Staging:
    """A folder beside its target that takes the target's name when it is complete.

    Its name tells its key, so that another process can go on with it.
    """

    def __init__(self, target: Path, *, replace: bool = False, key: str | None = None) -> None:
        """Nothing is made or checked yet.

        Args:
            target: where the folder shall appear; the folders above it are made.
            replace: put it in place of an earlier result.
            key: whose it is; one that nobody else has if not given.
        """
        self.target = target
        self.folder = target.parent / f".{target.name}.{key or uuid4().hex[:8]}.part"
        self._replace = replace
        self._aside = self.folder.with_suffix(".old")

    def open(self) -> Path:
        """Make the folder, or find it as it was left.

        Raises:
            InputError: the target exists (and is not to be replaced, or is no result of ours), or
                cannot be written to.
        """
        self._check_free()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                "output-not-writable",
                f"The output folder cannot be made: {error.strerror or error}.",
                where=str(self.target),
                fix="Give a folder you may write to with ‹output›.",
            ) from error
        return self.folder

    def flush(self) -> None:
        """Make what is in the folder survive a power cut."""
        flush(*self.folder.rglob("*"), self.folder)

    def publish(self) -> None:
        """Rename into place, or do nothing where that is done already.

        An earlier result steps aside first and goes when the new one stands.

        Raises:
            InputError: something else was written there meanwhile.
        """
        if self.folder.exists():
            self.flush()
            self._put()
        shutil.rmtree(self._aside, ignore_errors=True)

    def discard(self) -> None:
        """Leave nothing; what stood at the target stands there still. After `publish`, do nothing."""
        shutil.rmtree(self.folder, ignore_errors=True)
        if self._aside.exists() and not self.target.exists():
            os.rename(self._aside, self.target)

    def _check_free(self) -> None:
        target = self.target
        if not target.exists() and not target.is_symlink():
            return
        if not self._replace:
            raise InputError(
                "output-exists",
                "The output folder exists already.",
                where=str(target),
                fix="Give another one with ‹output›, or replace it with ‹replace›.",
            )
        if not (target / MARK).is_file() or target.is_symlink():
            raise InputError(
                "output-not-a-result",
                "The output folder holds no earlier result, so it will not be replaced.",
                where=str(target),
                fix="Give another folder with ‹output›.",
            )

    def _put(self) -> None:
        if self._replace and self.target.exists():
            os.rename(self.target, self._aside)
        try:
            os.rename(self.folder, self.target)
        except OSError as error:
            if self._aside.exists():
                os.rename(self._aside, self.target)
            raise InputError(
                "output-exists",
                f"The output folder could not be put in place: {error.strerror or error}.",
                where=str(self.target),
                fix="Something else was written there meanwhile: give another folder with ‹output›.",
            ) from error
        flush(self.target.parent)


@contextmanager
def staged_folder(target: Path, *, replace: bool = False) -> Generator[Path]:
    """A temporary folder beside `target` that takes its name when the block ends well.

    Everything in it is flushed to the disk before the one rename; on any exception it is removed and
    what stood at `target` stays as it was.

    Raises:
        InputError: see `Staging.open` and `Staging.publish`.
    """
    staging = Staging(target, replace=replace)
    try:
        yield staging.open()
        staging.publish()
    finally:
        staging.discard()


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
