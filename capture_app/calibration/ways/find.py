"""find_mount: a mount by any of the ways."""

from capture_app.calibration.ways.by_camera import by_board, by_tracker
from capture_app.calibration.ways.by_phone import by_floor, by_scan, by_session
from capture_app.calibration.ways.by_screen import by_screen
from capture_app.commands.calibrate.by_camera import BoardWay, ScreenWay
from capture_app.commands.calibrate.by_phone import FloorWay, ScanWay, SessionWay
from capture_app.commands.calibrate.request import AnyWay
from capture_app.progress import Progress
from ingest.mount import Mount


def find_mount(way: AnyWay, progress: Progress) -> Mount:
    """Find it; progress is told the stages "board" and "localise".

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
