"""Spectacular AI: data.jsonl and calibration.json of one folder, data.mov (or another ending).

Each line of data.jsonl is an object with a `time` in seconds. Lines with `groundTruth`, or the
name of a method, carry `position` and `orientation`: the IMU's pose in a world that is z up. Lines
with `frames` are the images of the video. `imuToCamera` in calibration.json takes the IMU's points
into the camera (OpenCV axes, the landscape of the video).
"""

import json
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import (
    arkit_poses,
    at_times,
    check_poses,
    poses_from_matrices,
    poses_from_quaternions,
)
from ingest.formats.json_log import (
    CameraKeys,
    Record,
    Records,
    line_records,
    list_at,
    load_object,
    member,
    nested,
    object_at,
    pinhole,
)
from ingest.formats.still_images import file_inside
from ingest.formats.text_table import first_row
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

NAME = "Spectacular AI"
FILES = "a folder with data.jsonl (with poses in it) and calibration.json"
LACKS = "no poses before the recording is processed, no tracking state; its IMU is not read"

CAMERA: CameraKeys = (
    "focalLengthX",
    "focalLengthY",
    "principalPointX",
    "principalPointY",
    "imageWidth",
    "imageHeight",
)
VIDEOS = ("data.mov", "data.mp4", "data.mkv", "data.m4v", "data.avi")
_DATA = {"groundTruth", "frames", "sensor", "gps", "output", "vio"}
"""What a first line may hold besides its time."""


def detect(path: Path) -> bool:
    """Whether the first line of the file, or of the folder's data.jsonl, has a time and data."""
    try:
        first = json.loads(first_row(_log(path)))
    except (ValueError, RecursionError):
        return False
    return isinstance(first, dict) and "time" in first and bool(_DATA & first.keys())


def read(path: Path) -> CaptureSession:
    """Read a session folder (or the data.jsonl in it), with calibration.json beside it.

    Raises:
        InputError: "poses-missing" for a recording of sensors only, "poses-ambiguous" for several
            methods and no ground truth; besides what every log is checked for.
    """
    log = _log(path)
    streams, images = _streams(log)
    name, poses = _choose(streams, log)
    times = poses.column("time")
    parts = nested(poses, name)
    T_world_imu = poses_from_quaternions(
        nested(parts, "position").columns(("x", "y", "z")),
        nested(parts, "orientation").columns(("x", "y", "z", "w")),
        poses.place,
    )
    calibration = _calibration(log.parent / "calibration.json")
    T_camera_imu = poses_from_matrices(calibration.column("imuToCamera", 4, 4), calibration.place)
    T = arkit_poses(T_world_imu @ inverse(T_camera_imu))
    check_poses(times, T, log, poses.place)
    intrinsics, image_size = _intrinsics(calibration, images, times)
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=image_size,
        video=file_inside(log.parent, *VIDEOS),
        video_times=images.column("time") if images.rows else None,
    )


def _log(path: Path) -> Path:
    return path / "data.jsonl" if path.is_dir() else path


def _streams(log: Path) -> tuple[dict[str, Records], Records]:
    """The lines with full poses, by the name of what made them, and those of images."""
    poses: dict[str, list[Record]] = {}
    images: list[Record] = []
    for row in line_records(log):
        if "frames" in row.values:
            images.append(row)
        for name, value in row.values.items():
            if isinstance(value, dict) and {"position", "orientation"} <= value.keys():
                poses.setdefault(name, []).append(row)
    return {name: Records(tuple(rows)) for name, rows in poses.items()}, Records(tuple(images))


def _choose(streams: dict[str, Records], log: Path) -> tuple[str, Records]:
    if not streams:
        raise InputError(
            "poses-missing",
            f"{log.name} has no poses (position and orientation): Spectacular Rec records sensors "
            "only.",
            where=str(log),
            fix="Process the recording with the Spectacular AI tools and give the result.",
        )
    name = "groundTruth" if "groundTruth" in streams else next(iter(streams))
    if len(streams) > 1 and name != "groundTruth":
        raise InputError(
            "poses-ambiguous",
            f"{log.name} has poses of {len(streams)} methods: {', '.join(streams)}.",
            where=str(log),
            fix="Keep the lines of one method.",
        )
    return name, streams[name]


def _calibration(file: Path) -> Records:
    """The first camera, a record of its own."""
    if not file.is_file():
        raise InputError(
            "calibration-missing",
            f"There is no {file.name}: the poses are the IMU's, and where the camera is stands there.",
            where=str(file),
            fix="Give the whole folder of the recording.",
        )
    cameras = list_at(member(load_object(file), "cameras", file), file, "cameras")
    first = cameras[0] if cameras else None
    return Records((Record(object_at(first, file, "cameras[0]"), file, "cameras[0]"),))


def _intrinsics(
    calibration: Records, images: Records, times: Float64[np.ndarray, " frames"]
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """Those logged with the images where they are, else those of the calibration."""
    if not calibration.any_has(CAMERA[4]):
        return None, None
    constant, image_size = pinhole(calibration, CAMERA)
    first = Records(tuple(_first_camera(row) for row in images.rows))
    if first.any_has("cameraParameters"):
        logged = nested(first, "cameraParameters").columns(CAMERA[:4])
        return at_times(times, images.column("time"), logged), image_size
    return None if constant is None else np.tile(constant, (len(times), 1)), image_size


def _first_camera(row: Record) -> Record:
    where = f"{row.where}, frames[0]"
    cameras = list_at(row.values["frames"], row.path, f"{row.where}, frames")
    return Record(object_at(cameras[0] if cameras else None, row.path, where), row.path, where)
