"""save_page: a file that appears whole or not at all."""

import os
from pathlib import Path
from uuid import uuid4

from omomo_core.errors import InputError


def save_page(text: str, path: Path) -> None:
    """Write a text, in place of an earlier file of that name.

    Raises:
        InputError: "output-not-writable"; what stood there before stands there still.
    """
    partial = path.with_name(f".{path.name}.{uuid4().hex[:8]}.part")
    try:
        with partial.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        raise InputError(
            "output-not-writable",
            f"The file cannot be written: {error.strerror or error}.",
            where=str(path),
            fix="Give a file in a folder that is there and that you may write to.",
        ) from error
    finally:
        partial.unlink(missing_ok=True)
