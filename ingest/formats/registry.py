"""The formats that are known, and the choice of the one that a recording is in."""

import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from ingest.archive import is_archive, unpack
from ingest.formats import (
    anysense,
    arkit_data_logger,
    arkit_recorder,
    arkitscenes,
    ios_logger,
    iphumi,
    nerfcapture,
    nerfstudio,
    polycam,
    pose_table,
    record3d,
    scan_capture,
    scanner_3d,
    scannetpp,
    spectacular,
    stray_scanner,
    tum,
)
from ingest.session import CaptureSession
from omomo_core.errors import InputError


@runtime_checkable
class Format(Protocol):
    """What each module of this folder offers."""

    @property
    def NAME(self) -> str:
        """The app's name."""
        ...

    @property
    def FILES(self) -> str:
        """What to give, e.g. "a folder with odometry.csv"."""
        ...

    @property
    def LACKS(self) -> str:
        """What the app does not log or needs, e.g. "no tracking state; needs LiDAR"."""
        ...

    def detect(self, path: Path) -> bool:
        """Whether the file or folder is such a session, from a cheap look that accepts anything."""
        ...

    def read(self, path: Path) -> CaptureSession:
        """Read what `detect` claims, or raise an InputError."""
        ...


FORMATS: tuple[Format, ...] = (
    stray_scanner,
    scan_capture,
    record3d,
    ios_logger,
    arkit_data_logger,
    arkit_recorder,
    nerfcapture,
    polycam,
    scanner_3d,
    iphumi,
    anysense,
    spectacular,
    arkitscenes,
    scannetpp,
    nerfstudio,
    pose_table,
    tum,
)
"""Those that suit best first."""
_REGISTERED: list[Format] = []


def register_format(format_: Format) -> None:
    """Read the sessions of another app too, as long as this process runs.

    `read_session`, and with it `inspect_take`, `run_take` and `calibrate`, then know it like those that
    are built in.

    Args:
        format_: a module or an object with everything that `Format` lists; it takes the place of one of
            the same name that was registered before.

    Raises:
        InputError: "format-known": a format that is built in has this name.
    """
    name = format_.NAME.lower()
    if any(known.NAME.lower() == name for known in FORMATS):
        raise InputError(
            "format-known",
            f"There is a format called {format_.NAME!r} already.",
            fix="Give yours another NAME.",
        )
    _REGISTERED[:] = [*(f for f in _REGISTERED if f.NAME.lower() != name), format_]


def known_formats() -> tuple[Format, ...]:
    """Those that are built in, then those that were registered."""
    return *FORMATS, *_REGISTERED


def format_named(name: str) -> Format:
    """The format of an app, whatever the case of its name.

    Raises:
        InputError: "format-unknown", with the names that there are.
    """
    for format_ in known_formats():
        if format_.NAME.lower() == name.strip().lower():
            return format_
    raise InputError(
        "format-unknown",
        f"No format is called {name!r}.",
        field="format",
        fix=f"Give one of {', '.join(f.NAME for f in known_formats())}.",
    )


Formats = tuple[Format, ...]

_MOST_READ = 1e4
"""m/s^2 or rad/s."""
_MAX_FOLDERS = 1000
"""Looked into; more than that is a disk, not a share of a session."""
_ALIKE = 0.75
"""Least similarity (0 to 1) of two names that is worth a suggestion."""


def read_session(path: Path, app: str | None = None) -> CaptureSession:
    """Read a session: its folder, its pose file, an archive, or a folder around its folder.

    An archive is a .zip, .r3d, .tar or .tar.gz of any of these, told by its content. A session may
    lie one or two folders down, if it is the only one there (four in Xcode's .xcappdata). Hidden folders
    are not looked into.

    Args:
        path: of any of these.
        app: name of the format to read it as, whatever it looks like; None finds it out.

    Raises:
        InputError: "session-missing", "session-unknown", "session-ambiguous", "session-unreadable",
            "format-unknown"; "archive-..." for an archive that is not unpacked; or a defect in the log.
    """
    formats = known_formats() if app is None else (format_named(app),)
    try:
        check_there(path)
        if path.is_file() and is_archive(path):
            return _read_archive(path, formats)
        return replace(_read(path, formats), source=path)
    except OSError as error:
        raise InputError(
            "session-unreadable",
            f"It cannot be read: {error.strerror or error}.",
            where=str(error.filename or path),
            fix="Check that you may read it and that its disk is there; copy the session here.",
        ) from error


def check_there(path: Path) -> None:
    """Refuse a path at which nothing is.

    Raises:
        InputError: "session-missing".
    """
    if not path.exists():
        raise InputError(
            "session-missing",
            "There is no such file or folder.",
            where=str(path),
            fix="Check the path.",
        )


def check_is_session(path: Path) -> None:
    """Refuse what no format claims, without reading any log.

    Args:
        path: as for `read_session`.

    Raises:
        InputError: "session-unknown"; what else is wrong with a session, its reader says.
    """
    if not is_archive(path):
        _find(path, known_formats())
        return
    try:
        _find(unpack(path), known_formats())
    except InputError as error:
        raise InputError(error.code, error.what, where=path.name, fix=error.fix) from error


def _read_archive(path: Path, formats: Formats) -> CaptureSession:
    folder = unpack(path)
    try:
        return replace(_read(folder, formats), source=path)
    except InputError as error:
        # The user knows the archive, not the folder that it was unpacked into.
        where = error.where.replace(str(folder), str(path))
        raise InputError(error.code, error.what, where=where, fix=error.fix) from error


def _read(path: Path, formats: Formats) -> CaptureSession:
    format_, place = _find(path, formats)
    return _read_as(format_, place)


def _find(path: Path, formats: Formats) -> tuple[Format, Path]:
    """The format of a session, and where its folder or file is."""
    if (format_ := _format_of(path, formats)) is not None:
        return format_, path
    found = _sessions_in(path, formats)
    if len(found) > 1:
        names = _names([str(folder.relative_to(path)) for folder, _ in found])
        raise InputError(
            "session-ambiguous",
            f"The folder holds {len(found)} sessions: {names}.",
            where=str(path),
            fix="Pass one of these folders.",
        )
    for folder, format_ in found:
        return format_, folder
    if len(formats) == 1 and path.is_file():
        return formats[0], path  # whoever names the format is told what is amiss
    raise _not_a_session(path, formats)


def _read_as(format_: Format, path: Path) -> CaptureSession:
    """The session, checked for what no format may say; of poses with one stamp the first counts."""
    session = _without_repeats(format_.read(path))
    _check_imu(session, path)
    if session.image_size is not None and min(session.image_size) <= 0:
        width, height = session.image_size
        raise InputError(
            "image-size",
            f"The log says that its images are {width} x {height} pixels.",
            where=str(path),
            fix="Write the size of the images as the app's film has it, or leave it out.",
        )
    return session


def _check_imu(session: CaptureSession, path: Path) -> None:
    """Refuse readings that no sensor gives: a phone's end at 16 g and 35 rad/s."""
    imu = session.imu
    if imu is None:
        return
    for name, unit, values in (
        ("accelerometer", "m/s^2", imu.accel),
        ("gyroscope", "rad/s", imu.gyro),
    ):
        most = float(np.abs(values).max(initial=0.0))
        if not most < _MOST_READ:
            raise InputError(
                "imu-absurd",
                f"The {name} reads {most:.3g} {unit}.",
                where=str(path),
                fix="Copy the session from the phone again, or take the log of the IMU out of it.",
            )


def _sessions_in(path: Path, formats: Formats) -> list[tuple[Path, Format]]:
    """The session folders one down, and two down in folders that are none themselves.

    Xcode's copy of an app's container has the app's documents two folders further down.
    """
    found: list[tuple[Path, Format]] = []
    looked = 0
    level = _subfolders(path)
    for _ in range(4 if path.suffix == ".xcappdata" else 2):
        looked += len(level)
        if looked > _MAX_FOLDERS:
            raise InputError(
                "session-unknown",
                f"It holds more than {_MAX_FOLDERS} folders and is no session itself.",
                where=str(path),
                fix="Give the folder of the session.",
            )
        claims = [(folder, _format_of(folder, formats)) for folder in level]
        found += [(folder, format_) for folder, format_ in claims if format_ is not None]
        level = [deep for folder, claim in claims if claim is None for deep in _subfolders(folder)]
    return found


def _format_of(path: Path, formats: Formats) -> Format | None:
    if not (path.is_dir() or path.is_file()):
        return None
    matches = [format_ for format_ in formats if format_.detect(path)]
    if len(matches) > 1:
        names = " and ".join(m.NAME for m in matches)
        what, fix = (
            f"The folder holds logs of several apps: {names}.",
            "Keep one session per folder",
        )
        if path.is_file():
            what = (
                f"{path.name} can be read as {names}: nothing in it says which numbers mean what."
            )
            fix = "Add a header line that names the columns"
        raise InputError(
            "session-ambiguous",
            what,
            where=str(path),
            fix=f"{fix}, pass the pose file itself, or say which it is: "
            + " or ".join(f'‹format› "{m.NAME}"' for m in matches)
            + ".",
        )
    return matches[0] if matches else None


def _not_a_session(path: Path, formats: Formats) -> InputError:
    if path.is_dir():
        entries = sorted(entry.name for entry in path.iterdir())
        found = f"it holds {_names(entries)}" if entries else "it is empty"
    else:
        entries = [path.name]
        found = f"{path.name} has {path.stat().st_size} bytes and none of their layouts"
    named = f"no {formats[0].NAME} session" if len(formats) == 1 else "not a phone session"
    near = _nearest(entries, formats)
    fix = f"The nearest is {near.NAME}, which is {near.FILES}. " if near else ""
    return InputError(
        "session-unknown",
        f"This is {named}: {found}.",
        where=str(path),
        fix=f"{fix}Give the folder that the app wrote, or a .zip, .tar or .tar.gz of it; ‹omocap formats› "
        "lists all that are read.",
    )


def _subfolders(path: Path) -> list[Path]:
    if not path.is_dir():
        return []
    hidden = (".", "__MACOSX")
    return sorted(p for p in path.iterdir() if p.is_dir() and not p.name.startswith(hidden))


def _names(names: list[str]) -> str:
    shown = ", ".join(names[:8])
    return f"{shown} and {len(names) - 8} more" if len(names) > 8 else shown


def _nearest(names: Sequence[str], formats: Sequence[Format]) -> Format | None:
    """Return the format whose expected file name is most similar to one of these names, or None.

    Args:
        names: names of the entries of the folder.
        formats: the formats to choose from.
    """
    best: tuple[float, Format | None] = (_ALIKE, None)
    for format_ in formats:
        for asked in re.findall(r"\w+\.\w{2,5}", format_.FILES):
            for name in names:
                alike = SequenceMatcher(None, asked.lower(), name.lower()).ratio()
                if alike > best[0]:
                    best = (alike, format_)
    return best[1]


def _without_repeats(session: CaptureSession) -> CaptureSession:
    """Return the session with the first pose of each time stamp, and a note that counts the others."""
    new = np.concatenate([[True], np.diff(session.times) > 0])
    left_out = int((~new).sum())
    if left_out == 0:
        return session
    K, ok = session.intrinsics, session.tracking_ok
    poses = "pose has the stamp of the pose" if left_out == 1 else "poses have the stamps of those"
    return replace(
        session,
        times=session.times[new],
        T_world_phone=session.T_world_phone[new],
        intrinsics=None if K is None else K[new],
        tracking_ok=None if ok is None else ok[new],
        notes=(*session.notes, f"{left_out} {poses} before; only the first of each stamp counts."),
    )
