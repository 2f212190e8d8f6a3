"""Folders that appear whole or not at all."""

import os
import shutil
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from omomo_core.errors import InputError

MARK = "manifest.json"
"""A folder that holds this file is one of ours, and may be replaced."""


@contextmanager
def staged_folder(target: Path, *, replace: bool = False) -> Generator[Path]:
    """A temporary folder beside `target` that takes its name when the block ends well.

    Everything in it is flushed to the disk before the one rename; on any exception it is removed and
    what stood at `target` stays as it was.

    Args:
        target: where the folder shall appear; the folders above it are made.
        replace: put it in place of an earlier result.

    Raises:
        InputError: `target` exists (and is not to be replaced, or is no result of ours), or cannot
            be written to.
    """
    _check_free(target, replace)
    staging = _make_beside(target)
    try:
        yield staging
        _flush([*staging.rglob("*"), staging])
        _put(staging, target, replace)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _check_free(target: Path, replace: bool) -> None:
    if not target.exists() and not target.is_symlink():
        return
    if not replace:
        raise InputError(
            "output-exists",
            "The output folder exists already.",
            where=str(target),
            fix="Give another one with -o, or replace it with --replace.",
        )
    if not (target / MARK).is_file() or target.is_symlink():
        raise InputError(
            "output-not-a-result",
            "The output folder holds no earlier result, so it will not be replaced.",
            where=str(target),
            fix="Give another folder with -o.",
        )


def _make_beside(target: Path) -> Path:
    staging = target.parent / f".{target.name}.{uuid4().hex[:8]}.part"
    try:
        staging.mkdir(parents=True)
    except OSError as error:
        raise InputError(
            "output-not-writable",
            f"The output folder cannot be made: {error.strerror or error}.",
            where=str(target),
            fix="Give a folder you may write to with -o.",
        ) from error
    return staging


def _flush(paths: Iterable[Path]) -> None:
    for path in paths:
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _put(staging: Path, target: Path, replace: bool) -> None:
    """Rename into place; an earlier result steps aside first and goes when the new one stands."""
    aside = staging.with_suffix(".old")
    if replace and target.exists():
        os.rename(target, aside)
    try:
        os.rename(staging, target)
    except OSError as error:
        if aside.exists():
            os.rename(aside, target)
        raise InputError(
            "output-exists",
            f"The output folder could not be put in place: {error.strerror or error}.",
            where=str(target),
            fix="Something else was written there meanwhile: give another folder with -o.",
        ) from error
    _flush([target.parent])
    shutil.rmtree(aside, ignore_errors=True)
