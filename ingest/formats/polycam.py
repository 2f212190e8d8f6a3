"""Polycam raw data (developer mode): keyframes/{cameras,images,depth,...}/<microseconds>.*

ARKit axes and y-up world, three rows t_00..t_23. The corrected_ folders hold the poses after
Polycam's own optimisation and the undistorted images that belong to them; they are used when they
cover the whole take.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import check_poses, poses_from_matrices
from ingest.formats.json_log import (
    CameraKeys,
    Record,
    Records,
    load_object,
    mentions,
    one_file_each,
    pinhole,
)
from ingest.formats.still_images import depth_log_mm, file_inside, stills
from ingest.session import CaptureSession
from ingest.session_images import picture_size
from omomo_core.errors import InputError

NAME = "Polycam"
FILES = "a raw data folder with keyframes/cameras"
LACKS = "a few keyframes a second only: for scanning an object, not for following it; needs LiDAR"
CAMERA: CameraKeys = ("fx", "fy", "cx", "cy", "width", "height")
_SIZE = frozenset(CAMERA[4:])
MATRIX = tuple(f"t_{row}{column}" for row in range(3) for column in range(4))


def detect(path: Path) -> bool:
    """Whether the folder holds camera files with t_00..t_23, or the file is one of them."""
    if path.is_file():
        return path.parent.name in ("cameras", "corrected_cameras") and mentions(path, *MATRIX)
    first = next(iter(_cameras(_keyframes(path))), None)
    return first is not None and mentions(first, *MATRIX)


def read(path: Path) -> CaptureSession:
    """Read the raw data folder, its keyframes, or the take that a camera file belongs to."""
    folder = _keyframes(path)
    files = _cameras(folder)
    times = np.array([_seconds(file) for file in files])
    order = np.argsort(times, kind="stable")
    times, files = times[order], [files[i] for i in order]
    records = _with_raw(one_file_each(files), folder / "cameras")
    T = poses_from_matrices(records.columns(MATRIX).reshape(-1, 3, 4), records.place)
    log = files[0].parent
    check_poses(times, T, log, records.place)
    names = [file.stem for file in files]
    # Newer versions export corrected cameras without corrected images.
    kinds = log.name.replace("cameras", "images"), "images"
    kind = next((kind for kind in kinds if (folder / kind).is_dir()), kinds[0])
    images, image_times = stills(times, [file_inside(folder / kind, f"{n}.jpg") for n in names])
    intrinsics, image_size = _camera(records, images)
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=image_size,
        video_times=image_times,
        images=images,
        depth=depth_log_mm(times, [file_inside(folder / "depth", f"{n}.png") for n in names]),
    )


def _with_raw(records: Records, raw: Path) -> Records:
    """The records, each with what the phone's own file of the same name says besides.

    Since November 2025 corrected cameras have no width and height
    (https://github.com/nerfstudio-project/nerfstudio/pull/3725).
    """
    rows: list[Record] = []
    for row in records.rows:
        file = raw / row.path.name
        more = load_object(file) if not row.values.keys() >= _SIZE and file.is_file() else {}
        size = {key: more[key] for key in _SIZE if key in more}
        rows.append(replace(row, values=size | row.values))
    return Records(tuple(rows))


def _camera(
    records: Records, images: tuple[Path, ...] | None
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """Intrinsics and the size that they refer to: as stated, or that of the images."""
    if any(row.values.keys() >= _SIZE for row in records.rows) or not records.any_has(CAMERA[0]):
        return pinhole(records, CAMERA)
    size = picture_size(images[0]) if images else None
    return (None, None) if size is None else (records.columns(CAMERA[:4]), size)


def _keyframes(path: Path) -> Path:
    """The folder that holds `cameras`."""
    if path.is_file():
        return path.parent.parent
    return path / "keyframes" if (path / "keyframes").is_dir() else path


def _cameras(keyframes: Path) -> list[Path]:
    """The corrected camera files where there are as many, else those of the phone."""
    raw, corrected = (
        sorted((keyframes / name).glob("*.json")) for name in ("cameras", "corrected_cameras")
    )
    return corrected if {file.name for file in corrected} >= {file.name for file in raw} else raw


def _seconds(file: Path) -> float:
    if not (file.stem.isascii() and file.stem.isdigit() and len(file.stem) < 20):
        raise InputError(
            "log-no-times",
            f"{file.name} is not named by a time in microseconds.",
            where=str(file),
            fix="Give the keyframes as Polycam exported them, their names unchanged.",
        )
    return int(file.stem) * 1e-6
