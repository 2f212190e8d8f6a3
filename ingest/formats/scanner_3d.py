"""3D Scanner App ("All Data"): frame_00000.json, fewer frame_00000.jpg, depth_00000.png.

ARKit axes and y-up world, matrices row by row, seconds since boot. Image and depth share the
number of their pose; the size of the images is theirs alone.
"""

import re
from pathlib import Path

from ingest.formats.camera_poses import check_poses, from_matrices, poses_from_matrices
from ingest.formats.json_log import mentions, one_file_each
from ingest.formats.still_images import depth_log_mm, file_inside, stills
from ingest.session import CaptureSession
from ingest.session_images import picture_size

NAME = "3D Scanner App"
FILES = 'an "All Data" folder with frame_00000.json'
LACKS = "no inertial data; needs LiDAR"
_KEYS = ("cameraPoseARFrame", "time")


def detect(path: Path) -> bool:
    """Whether the folder's first frame_*.json (or the file) has the app's keys."""
    first = path if path.is_file() else next(iter(_frames(path)), None)
    return first is not None and _number(first) is not None and mentions(first, *_KEYS)


def read(path: Path) -> CaptureSession:
    """Read a session folder, or the one that a frame's file lies in."""
    folder = path if path.is_dir() else path.parent
    files = _frames(folder)
    records = one_file_each(files)
    times = records.column("time")
    T = poses_from_matrices(
        records.column("cameraPoseARFrame", 16).reshape(-1, 4, 4), records.place
    )
    check_poses(times, T, folder, records.place)
    intrinsics = None
    if records.any_has("intrinsics"):
        K = records.column("intrinsics", 9).reshape(-1, 3, 3)
        intrinsics = from_matrices(K, records.place)
    names = [file.stem for file in files]
    images, image_times = stills(times, [file_inside(folder, f"{name}.jpg") for name in names])
    numbers = [name.removeprefix("frame_") for name in names]
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=picture_size(images[0]) if images else None,
        video_times=image_times,
        images=images,
        depth=depth_log_mm(times, [file_inside(folder, f"depth_{n}.png") for n in numbers]),
    )


def _frames(folder: Path) -> list[Path]:
    """Pose files by number (beyond 99999 names have more digits)."""
    numbered = [(_number(file), file) for file in folder.glob("frame_*.json")]
    return [file for _, file in sorted((n, file) for n, file in numbered if n is not None)]


def _number(file: Path) -> int | None:
    match = re.fullmatch(r"frame_(\d{1,9})\.json", file.name, re.ASCII)
    return int(match[1]) if match else None
