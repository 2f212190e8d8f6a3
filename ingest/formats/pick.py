"""Cheap tests of a file's content that never raise, and the one log of a folder."""

from collections.abc import Callable, Sequence
from pathlib import Path

from omomo_core.errors import InputError

_HEAD_BYTES = 65536
_MAX_TAKES = 64
"""A folder with more files of a kind holds a file for each frame, not takes."""


def head_lines(path: Path) -> list[str]:
    """The lines within the first 64 KB; [] where there is no file to read."""
    if not path.is_file():  # a pipe would be waited for
        return []
    try:
        with path.open("rb") as file:
            text = file.read(_HEAD_BYTES).decode("utf-8", errors="replace")
    except OSError:
        return []
    return text.removeprefix("\ufeff").split("\n")


def first_row(path: Path) -> str:
    """The first line of a text log that is neither blank nor a # comment; "" where there is none."""
    rows = (line.strip() for line in head_lines(path))
    return next((row for row in rows if row and not row.startswith("#")), "")


def floats(fields: Sequence[str]) -> list[float]:
    """The fields as numbers; [] as soon as one is none."""
    try:
        return [float(field) for field in fields]
    except ValueError:
        return []


def logs(path: Path, names: Sequence[str], is_log: Callable[[Path], bool]) -> list[Path]:
    """The file itself, or the files of the folder matching a name pattern, where `is_log` holds."""
    files = {file for name in names for file in path.glob(name)} if path.is_dir() else {path}
    if len(files) > _MAX_TAKES:
        return []
    return sorted(file for file in files if file.is_file() and is_log(file))


def only_log(path: Path, found: Sequence[Path]) -> Path:
    """The file itself, or the one log found in the folder.

    Raises:
        InputError: "session-ambiguous" for a folder with none or several.
    """
    if not path.is_dir():
        return path
    if len(found) == 1:
        return found[0]
    names = ", ".join(file.name for file in found[:8])
    raise InputError(
        "session-ambiguous",
        f"The folder holds {len(found)} trajectories{': ' if names else ''}{names}.",
        where=str(path),
        fix="Pass one of these files instead of the folder.",
    )
