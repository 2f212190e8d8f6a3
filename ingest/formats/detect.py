"""Which app wrote this? read_session looks at the content and reads it."""

from pathlib import Path
from typing import Protocol, runtime_checkable

from ingest.formats import arkit_data_logger, ios_logger, stray_scanner
from ingest.session import CaptureSession
from omomo_core.errors import InputError


@runtime_checkable
class Format(Protocol):
    """What each module of this folder offers."""

    @property
    def NAME(self) -> str: ...  # noqa: D102
    @property
    def FILES(self) -> str: ...  # noqa: D102

    def detect(self, path: Path) -> bool: ...  # noqa: D102
    def read(self, path: Path) -> CaptureSession: ...  # noqa: D102
    def write(self, session: CaptureSession, folder: Path) -> Path: ...  # noqa: D102


FORMATS: tuple[Format, ...] = (stray_scanner, ios_logger, arkit_data_logger)


def read_session(path: Path) -> CaptureSession:
    """Read a session folder, its pose file, or a folder holding exactly one session folder.

    Raises:
        InputError: nothing there, not a session, several sessions, or a defect in the log.
    """
    if not path.exists():
        raise InputError(
            "session-missing",
            "There is no such file or folder.",
            where=str(path),
            fix="Check the path.",
        )
    if (format_ := _format_of(path)) is not None:
        return format_.read(path)
    inside = [folder for folder in _subfolders(path) if _format_of(folder) is not None]
    if len(inside) == 1:
        return read_session(inside[0])
    if inside:
        raise InputError(
            "session-ambiguous",
            f"The folder holds {len(inside)} sessions: {_names(inside)}.",
            where=str(path),
            fix="Pass one of these folders.",
        )
    raise _not_a_session(path)


def _format_of(path: Path) -> Format | None:
    matches = [format_ for format_ in FORMATS if format_.detect(path)]
    if len(matches) > 1:
        raise InputError(
            "session-ambiguous",
            f"The folder holds logs of several apps: {', '.join(m.NAME for m in matches)}.",
            where=str(path),
            fix="Keep one session per folder, or pass the pose file itself.",
        )
    return matches[0] if matches else None


def _not_a_session(path: Path) -> InputError:
    if path.is_dir():
        entries = sorted(path.iterdir())
        found = f"it holds {_names(entries)}" if entries else "it is empty"
    else:
        found = f"{path.name} has {path.stat().st_size} bytes and none of their layouts"
    known = "; ".join(f"{format_.NAME} ({format_.FILES})" for format_ in FORMATS)
    return InputError(
        "session-unknown",
        f"This is not a phone session: {found}.",
        where=str(path),
        fix=f"Give a session of {known}.",
    )


def _subfolders(path: Path) -> list[Path]:
    if not path.is_dir():
        return []
    hidden = (".", "__MACOSX")
    return sorted(p for p in path.iterdir() if p.is_dir() and not p.name.startswith(hidden))


def _names(paths: list[Path]) -> str:
    shown = ", ".join(path.name for path in paths[:8])
    return f"{shown} and {len(paths) - 8} more" if len(paths) > 8 else shown
