"""calibrate: from what was recorded to the mount file and its picture."""

from pathlib import Path

from capture_app.calibration.ways.find import find_mount
from capture_app.calibration.write_mount import write_mount
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
        progress: told the stages "board" and "localise".
        picture: PNG file to draw the phone on the object into, where the object is known.

    Returns:
        The mount as it was written.

    Raises:
        InputError: see `find_mount` and `write_mount`; nothing is written then.
    """
    mount = find_mount(way, progress)
    return write_mount(mount, path, way.mesh_file, way.phone, picture=picture)
