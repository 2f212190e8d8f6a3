"""A folder in the making: it gets its name when it is complete, and is never seen half written."""

import os
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from omomo_core.errors import InputError
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
