"""The formats that are known: one module each, all with the same attributes and functions."""

from pathlib import Path
from typing import Protocol, runtime_checkable

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
        where="--format",
        fix=f"Give one of {', '.join(f.NAME for f in known_formats())}.",
    )
