"""ARKitScenes: lowres_wide.traj, lowres_wide_intrinsics/*.pincam, images and depth as PNG files.

Lines of the trajectory: `t rx ry rz tx ty tz`, seconds; axis and angle (rad) and position of the
world in the camera (world-to-camera), OpenCV axes, a world that is z up. Files of images, depth
(16 bits, millimetres) and intrinsics (`w h fx fy cx cy`) are named `<video>_<t>`. Everything is in
the landscape of the sensor, 256 x 192.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.formats.camera_poses import arkit_poses, at_times, check_poses, one_size
from ingest.formats.pose_columns import (
    ROTATION_VECTORS,
    SIZED_INTRINSICS,
    Columns,
    first_pose,
    header_of,
    read_columns,
)
from ingest.formats.still_images import depth_log_mm, stills
from ingest.formats.text_table import floats, logs, only_log
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

NAME = "ARKitScenes"
FILES = "a folder with lowres_wide.traj"
LACKS = "no tracking state or IMU; poses are those of the laser scan, about ten a second"

IMAGES, INTRINSICS, DEPTH = "lowres_wide", "lowres_wide_intrinsics", "lowres_depth"
_COLUMNS = Columns(tuple(range(7)), 7, None, second=1.0, scale=1.0)
_CAMERA = Columns(tuple(range(6)), 6, None)


def detect(path: Path) -> bool:
    """Whether the file, or a .traj file of the folder, has seven numbers between blanks."""
    return bool(logs(path, ("*.traj",), _is_log))


def read(path: Path) -> CaptureSession:
    """Read a scene folder (or the .traj file in it); intrinsics are interpolated in time."""
    log = only_log(path, logs(path, ("*.traj",), _is_log))
    rows = read_columns(log, ROTATION_VECTORS, _COLUMNS)
    times, table = rows.clock.times, rows.table
    T_camera_world = np.tile(np.eye(4), (len(times), 1, 1))
    T_camera_world[:, :3, :3] = Rotation.from_rotvec(table.values[:, 1:4]).as_matrix()
    T_camera_world[:, :3, 3] = table.values[:, 4:]
    T = arkit_poses(inverse(T_camera_world))
    check_poses(times, T, log, table.place)
    intrinsics, image_size = _read_intrinsics(log.parent / INTRINSICS, times)
    images, image_times = stills(*_stamped(log.parent / IMAGES, "*.png"))
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=image_size,
        images=images,
        video_times=image_times,
        depth=depth_log_mm(*_stamped(log.parent / DEPTH, "*.png")),
    )


def _is_log(file: Path) -> bool:
    row = floats(first_pose(file, header_of(file, ROTATION_VECTORS)).split())
    # Positions and quaternions without times are as wide.
    off = abs(float(np.linalg.norm(np.clip(row[3:], -9, 9))) - 1)
    return len(row) == _COLUMNS.width and off > 1e-3


def _stamped(folder: Path, pattern: str) -> tuple[Float64[np.ndarray, " files"], tuple[Path, ...]]:
    """The files named `<video>_<t>`, by time."""
    named = [(floats([file.stem.rpartition("_")[2]]), file) for file in folder.glob(pattern)]
    for stamp, file in named:
        if not stamp:
            raise InputError(
                "log-damaged",
                f"{file.name} does not end in a time; files here are named <video>_<seconds>.",
                where=str(file),
                fix="Give the scene as it was published.",
            )
    named.sort(key=lambda item: (item[0], item[1]))
    return np.array([stamp[0] for stamp, _ in named]), tuple(file for _, file in named)


def _read_intrinsics(
    folder: Path, times: Float64[np.ndarray, " frames"]
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    stamps, files = _stamped(folder, "*.pincam")
    if not files:
        return None, None
    rows = np.array([_pincam(file) for file in files])
    size = one_size(rows[:, :2], lambda row: str(files[row]))
    return at_times(times, stamps, rows[:, 2:]), size


def _pincam(file: Path) -> Float64[np.ndarray, "6"]:
    """Width, height, fx, fy, cx, cy of one image."""
    values = read_columns(file, SIZED_INTRINSICS, _CAMERA).table.values
    if len(values) != 1:
        raise InputError(
            "log-damaged",
            f"{file.name} has {len(values)} lines of intrinsics instead of one.",
            where=str(file),
            fix="Give the scene as it was published.",
        )
    return values[0]
