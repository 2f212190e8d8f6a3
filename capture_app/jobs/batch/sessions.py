"""The sessions in a folder."""

from collections.abc import Iterator
from pathlib import Path

from capture_app.staging import MARK
from ingest.archive import is_archive
from ingest.formats.registry import FORMATS
from omomo_core.errors import InputError


def find_sessions(folder: Path) -> dict[str, Path]:
    """Every folder and archive in it that is or may be a session, by a name that no other has.

    A folder that is no session but has sessions in it stands for these. One in which nothing is
    recognised is named too: its job will tell what is wrong with it. Result folders and hidden ones
    are passed over, and so are files that are no archives.

    Raises:
        InputError: "batch-missing" or "batch-empty".
    """
    if not folder.is_dir():
        raise InputError(
            "batch-missing",
            "There is no such folder of sessions.",
            where=str(folder),
            fix="Give a folder that holds sessions, or a CSV table that names them.",
        )
    found = [path for child in sorted(folder.iterdir()) for path in _sessions(child)]
    if not found:
        raise InputError(
            "batch-empty",
            "The folder holds no session.",
            where=str(folder),
            fix="Give a folder in which each session is a folder or an archive.",
        )
    return named(found, folder)


def named(sessions: list[Path], folder: Path) -> dict[str, Path]:
    """Sessions by their path below a folder, written as one word; equal words get numbers."""
    names: dict[str, Path] = {}
    for session in sessions:
        inside = session.is_relative_to(folder)
        path = session.relative_to(folder) if inside else Path(session.name)
        words = path if session.is_dir() else path.with_suffix("")
        names[unused("_".join(words.parts), names)] = session
    return names


def unused(name: str, taken: dict[str, Path]) -> str:
    """The name, with the first number that makes it new."""
    numbered = (name if k == 1 else f"{name}_{k}" for k in range(1, len(taken) + 2))
    return next(candidate for candidate in numbered if candidate not in taken)


def _sessions(path: Path) -> Iterator[Path]:
    if path.name.startswith(".") or (path / MARK).is_file():
        return
    if path.is_file():
        if is_archive(path):
            yield path
    elif _is_session(path):
        yield path
    else:
        within = [child for child in sorted(path.iterdir()) if _is_session(child)]
        yield from within or [path]


def _is_session(path: Path) -> bool:
    if path.name.startswith("."):
        return False
    if path.is_file():
        return is_archive(path)
    return any(format_.detect(path) for format_ in FORMATS)
