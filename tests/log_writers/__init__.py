"""Sessions written as each app lays them out: what the readers of `ingest.formats` are tested with."""

from collections.abc import Callable
from pathlib import Path

from ingest.formats import stray_scanner
from ingest.formats.registry import Format
from ingest.session import CaptureSession
from tests.log_writers import (
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
    tum,
)

_WRITERS: dict[str, Callable[[CaptureSession, Path], Path]] = {
    f"ingest.formats.{writer.__name__.rpartition('.')[2]}": writer.write
    for writer in (
        stray_scanner,
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
        tum,
    )
}
"""By the module of the format's reader."""


def write_session(format_: Format, session: CaptureSession, folder: Path) -> Path:
    """Write a session as an app does; returns what its reader takes."""
    return _WRITERS[format_.__name__](session, folder)
