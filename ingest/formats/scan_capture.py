"""ScanCapture (of LaMAR): poses.txt, images.mp4, depth/<us>.bin. It logs the tracking state.

After # comments, each line is `timestamp_us, status, tx, ty, tz, qx, qy, qz, qw, w, h, fx, fy, cx,
cy, exposure_us`: ARKit's own poses, microseconds since boot. Image i of the video is line i. Depth
is float32 metres, row by row, in the landscape of the images.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32

from ingest.formats.camera_poses import check_poses, one_size, poses_from_quaternions
from ingest.formats.pose_columns import ColumnHeader, columns_of, header_of
from ingest.formats.still_images import sure_loader
from ingest.formats.text_table import NumberTable, TextRows, first_row, floats, numbers, read_rows
from ingest.session import CaptureSession, DepthLog
from omomo_core.errors import InputError

NAME = "ScanCapture"
FILES = "a folder with poses.txt"
LACKS = "nothing that is used here; its IMU files are not read"

STATUSES = (
    "normal",
    "excessive motion",
    "insufficient features",
    "initializing",
    "relocalizing",
    "no tracking",
    "unknown",
)
_WIDTH = 16
_CAMERA = ("w", "h", "fx", "fy", "cx", "cy")
_COLUMNS = (0, *range(2, 15))
"""All but the status and the exposure."""

SIZE = (256, 192)
"""Width and height."""


def detect(path: Path) -> bool:
    """Whether the file, or poses.txt of the folder, has a status among numbers, and enough fields.

    A status that the app does not write is left to `read`, which names it.
    """
    log = _log(path)
    fields = first_row(log).split(",") if log.is_file() else []
    return len(fields) == _WIDTH and sum(bool(floats([field])) for field in fields) == _WIDTH - 1


def read(path: Path) -> CaptureSession:
    """Read a session folder (or the poses.txt in it)."""
    log = _log(path)
    header = header_of(log)
    status, columns, second = (1, _COLUMNS, None) if header is None else _named(header)
    text = read_rows(log, ",")
    table = numbers(text, _WIDTH, columns)
    times, values = table.values[:, 0] * (second or 1e-6), table.values
    T = poses_from_quaternions(values[:, 1:4], values[:, 4:8], table.place)
    tracking_ok = _tracking_ok(text, table, status)
    check_poses(times, T, log, table.place)
    image_size = one_size(values[:, 8:10], table.place)
    video = log.parent / "images.mp4"
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=values[:, 10:14] if min(image_size) > 0 else None,
        image_size=image_size if min(image_size) > 0 else None,
        tracking_ok=tracking_ok,
        video=video if video.is_file() else None,
        video_times=times if video.is_file() else None,
        depth=_read_depth(log.parent / "depth"),
    )


def _log(path: Path) -> Path:
    return path / "poses.txt" if path.is_dir() else path


def _named(header: ColumnHeader) -> tuple[int, tuple[int, ...], float | None]:
    """Columns of the status and of all numbers as the header has them, and the unit of time it names."""
    columns = columns_of(header)
    names = [field.lower() for field in header.fields]
    unclear = [name for name in ("status", *_CAMERA) if names.count(name) != 1]
    if unclear:
        raise InputError(
            "header-unclear",
            f"The header of {header.path.name} names none or more than one column for "
            f"{', '.join(unclear)}.",
            where=f"{header.path}:{header.line}",
            fix="Give poses.txt as ScanCapture wrote it.",
        )
    camera = tuple(names.index(name) for name in _CAMERA)
    return names.index("status"), (*columns.places, *camera), columns.second


def _tracking_ok(text: TextRows, table: NumberTable, column: int) -> Bool[np.ndarray, " frames"]:
    statuses = [row[column] for row in text.rows]
    for i, status in enumerate(statuses):
        if status not in STATUSES:
            raise InputError(
                "tracking-unknown",
                f"{status[:30]!r} is no tracking state; ScanCapture writes {', '.join(STATUSES)}.",
                where=table.place(i),
                fix='Write "normal" only where the phone knew its pose, else "unknown".',
            )
    return np.array([status == "normal" for status in statuses], dtype=bool)


def _read_depth(folder: Path) -> DepthLog | None:
    """The maps that are named by their microseconds."""
    files = sorted((f for f in folder.glob("*.bin") if f.stem.isdigit()), key=lambda f: int(f.stem))
    if not files:
        return None
    times = np.array([int(file.stem) for file in files]) * 1e-6
    return DepthLog(times=times, files=tuple(files), load=sure_loader(files, load_metres))


def load_metres(file: Path) -> Float32[np.ndarray, "192 256"]:
    """Metres; what is not finite becomes 0 (unknown).

    Raises:
        InputError: "depth-damaged" for a file of another length.
    """
    width, height = SIZE
    size = file.stat().st_size
    if size != 4 * width * height:
        raise InputError(
            "depth-damaged",
            f"{file.name} has {size} bytes; a depth map of {width} x {height} has "
            f"{4 * width * height}.",
            where=str(file),
            fix="Copy the session from the phone again.",
        )
    metres = np.fromfile(file, dtype="<f4").reshape(height, width)
    return np.where(np.isfinite(metres), metres, np.float32(0))
