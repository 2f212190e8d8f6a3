"""A file that appears under its name when it is complete, or not at all."""

import errno
import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from omomo_core.errors import InputError

_CANNOT_WRITE = frozenset(
    (
        errno.ENOSPC,
        errno.EDQUOT,
        errno.EFBIG,
        errno.EACCES,
        errno.EPERM,
        errno.EROFS,
        errno.ENOENT,
        errno.ENOTDIR,
    )
)
"""Faults of the place, which another place mends."""


@contextmanager
def whole_file(path: Path) -> Generator[str]:
    """A temporary name beside `path` that becomes `path` when all went well, and is gone if not.

    Raises:
        InputError: "output-is-folder", or "output-not-writable" (a full disk, a forbidden or missing
            folder).
    """
    if path.is_dir():
        raise InputError(
            "output-is-folder",
            "The output file is a folder.",
            where=str(path),
            fix="Give the name of a file with -o.",
        )
    partial = path.with_name(f".{path.name}.partial")
    try:
        yield str(partial)
        with partial.open("rb") as written:
            os.fsync(written.fileno())
        partial.replace(path)
    except OSError as error:
        if error.errno not in _CANNOT_WRITE:
            raise
        raise InputError(
            "output-not-writable",
            f"The output file cannot be written: {error.strerror}.",
            where=str(path),
            fix="Free some space, or give another file with -o.",
        ) from error
    finally:
        partial.unlink(missing_ok=True)
