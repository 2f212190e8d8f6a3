"""calibrate: from what was recorded, by any of the ways, to the mount file and its picture."""

from pathlib import Path

from capture_app.calibration.ways.by_camera import by_board, by_screen, by_tracker
from capture_app.calibration.ways.by_phone import by_floor, by_scan, by_session
from capture_app.calibration.write_mount import write_mount
from capture_app.commands.calibrate.by_camera import BoardWay, ScreenWay
from capture_app.commands.calibrate.by_phone import FloorWay, ScanWay, SessionWay
from capture_app.commands.calibrate.request import AnyWay
from capture_app.progress import Progress, silent
from ingest.mount import Mount


def calibrate(
    way: AnyWay, path: Path, progress: Progress = silent, *, picture: Path | None = None
) -> Mount:
    """Find a mount and write it.

    Args:
        way: what was recorded.
        path: of the mount file.
        progress: called with the stages "board" and "localise".
        picture: PNG file to draw the phone on the object into, where the object is known.

    Returns:
        The mount as it was written.

    Raises:
        InputError: see `find_mount` and `write_mount`; nothing is written then.
    """
    mount = find_mount(way, progress)
    return write_mount(mount, path, way.mesh_file, way.phone, picture=picture)


def find_mount(way: AnyWay, progress: Progress) -> Mount:
    """Find it; progress is called with the stages "board" and "localise".

    Raises:
        InputError: what was recorded does not tell it, or cannot be read.
    """
    match way:
        case BoardWay():
            return by_board(way, progress)
        case SessionWay():
            return by_session(way, progress)
        case ScanWay():
            return by_scan(way, progress)
        case ScreenWay():
            return by_screen(way)
        case FloorWay():
            return by_floor(way)
        case _:
            return by_tracker(way)
