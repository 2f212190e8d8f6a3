"""Files that appear whole or not at all."""

import errno
import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from omomo_core.errors import InputError


@contextmanager
def complete(*targets: Path) -> Generator[tuple[Path, ...]]:
    """Temporary names beside the targets, of the same ending, that take their names together.

    Raises:
        InputError: a target is a folder, its folder does not exist or may not be written to, or the
            disk is full; nothing is left behind.
    """
    for target in targets:
        _check(target)
    partials = tuple(target.with_name(f".partial.{target.name}") for target in targets)
    try:
        yield partials
        for partial in partials:
            with partial.open("rb") as written:
                os.fsync(written.fileno())
        for partial, target in zip(partials, targets, strict=True):
            partial.replace(target)
    except OSError as error:
        raise _not_written(targets[0], error) from error
    finally:
        for partial in partials:
            partial.unlink(missing_ok=True)


def _check(target: Path) -> None:
    if target.is_dir():
        raise InputError(
            "output-is-a-folder",
            "The output file has the name of a folder.",
            where=str(target),
            fix="Give another name with -o.",
        )
    if not target.parent.is_dir():
        raise InputError(
            "output-not-writable",
            "The folder for the output file does not exist.",
            where=str(target.parent),
            fix="Make it, or give another file with -o.",
        )


def _not_written(target: Path, error: OSError) -> InputError:
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    return InputError(
        "disk-full" if full else "output-not-writable",
        f"The file cannot be written: {error.strerror or error}.",
        where=str(target),
        fix="Make room on the disk." if full else "Give a file you may write to with -o.",
    )
