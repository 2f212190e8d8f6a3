"""Files that appear under their names when they are complete, or not at all."""

import errno
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from omomo_core.errors import InputError
from omomo_core.system import flush

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_CANNOT_WRITE = (*_FULL, errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR)
"""Faults of the place, which another place mends."""


def check_target(file: Path, endings: Sequence[str] = ()) -> None:
    """Refuse a file of another kind, in no folder, or that is a folder, before anything slow starts.

    Raises:
        InputError: "output-is-folder", "output-ending" or "output-not-writable".
    """
    if file.is_dir():
        raise InputError(
            "output-is-folder",
            "The output file is a folder.",
            where=str(file),
            fix="Give the name of a file.",
        )
    if endings and not file.name.endswith(tuple(endings)):
        raise InputError(
            "output-ending",
            f"This output file must end in {' or '.join(endings)}.",
            where=str(file),
            fix="Give another name.",
        )
    if not file.parent.is_dir():
        raise InputError(
            "output-not-writable",
            "The folder for the output file does not exist.",
            where=str(file.parent),
            fix="Make it, or give another file.",
        )


def partial_of(target: Path) -> Path:
    """The name under which a file is written until it is whole; a killed process leaves it."""
    return target.with_name(f".partial.{target.name}")


@contextmanager
def whole_files(*targets: Path) -> Generator[tuple[Path, ...]]:
    """Names beside the targets, of the same endings, that become the targets together in the end.

    They are on the disk then, names and bytes. When anything fails they are gone, and what stood under
    the targets' names stands there still.

    Raises:
        InputError: "output-is-folder", "output-not-writable" or "disk-full".
    """
    for target in targets:
        check_target(target)
    partials = tuple(partial_of(target) for target in targets)
    try:
        yield partials
        flush(*partials)
        for partial, target in zip(partials, targets, strict=True):
            partial.replace(target)
        flush(*{target.parent for target in targets})
    except OSError as error:
        if error.errno not in _CANNOT_WRITE:
            raise
        raise _not_written(targets[0], error) from error
    finally:
        for partial in partials:
            partial.unlink(missing_ok=True)


@contextmanager
def whole_file(target: Path) -> Generator[Path]:
    """A name beside the target that becomes the target in the end; see `whole_files`."""
    with whole_files(target) as (partial,):
        yield partial


def write_whole(target: Path, text: str) -> None:
    """Write a text as UTF-8, in place of an earlier file of that name.

    Raises:
        InputError: see `whole_files`.
    """
    with whole_file(target) as partial:
        partial.write_text(text, encoding="utf-8")


def _not_written(target: Path, error: OSError) -> InputError:
    full = error.errno in _FULL
    return InputError(
        "disk-full" if full else "output-not-writable",
        f"The output file cannot be written: {error.strerror or error}.",
        where=str(target),
        fix="Make room on the disk, or give a file on another one."
        if full
        else "Give a file you may write to.",
    )
