"""NeRFCapture (offline): transforms.json, whose layout nerfstudio shares, and images/<i>.png.

ARKit's own axes and y-up world, though the file looks like nerfstudio's z-up one; the file names
have no ending, the frames are in the order in which they were written out. The depth images have
lost their range, so they are not read.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import check_poses, poses_from_matrices
from ingest.formats.json_log import (
    CameraKeys,
    JsonObject,
    Record,
    Records,
    inside,
    list_at,
    load_object,
    member,
    mentions,
    number_at,
    object_at,
    pinhole,
    text_at,
)
from ingest.formats.still_images import file_inside, stills
from ingest.session import CaptureSession

FILE = "transforms.json"
CAMERA: CameraKeys = ("fl_x", "fl_y", "cx", "cy", "w", "h")
_CAMERA_KEYS = (*CAMERA, "camera_angle_x", "camera_model")
_PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE")
"""Camera models of nerfstudio and COLMAP whose pictures a pinhole fits, but for a small distortion."""


def log_of(path: Path) -> Path:
    """The file itself, or the one in the folder."""
    return path / FILE if path.is_dir() else path


def read_frames(log: Path) -> tuple[JsonObject, Records]:
    """The whole object and its frames, each with the camera that stands at the top of the file.

    A frame's own camera goes before the common one.
    """
    top = load_object(log)
    common = {key: top[key] for key in _CAMERA_KEYS if key in top}
    frames = list_at(member(top, "frames", log), log, "frames")
    rows = [
        Record(common | object_at(frame, log, f"frame {i}"), log, f"frame {i}")
        for i, frame in enumerate(frames)
    ]
    return top, Records(tuple(rows))


def cameras_of(
    records: Records,
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None, tuple[str, ...]]:
    """fx, fy, cx, cy of every frame, the one image size, and a note where there are none to be used.

    As in nerfstudio, `fl_y` is `fl_x` where it is left out, the principal point the middle of the picture,
    and `camera_angle_x` (radians) stands for `fl_x`.
    """
    models = {str(row.values.get("camera_model", "OPENCV")) for row in records.rows}
    if odd := sorted(model for model in models if model.upper() not in _PINHOLES):
        return (
            None,
            None,
            (f"Its camera is {odd[0][:30]}, no pinhole, so its pictures are not used.",),
        )
    K, size = pinhole(Records(tuple(_completed(row) for row in records.rows)), CAMERA)
    return K, size, ()


def _completed(row: Record) -> Record:
    """The frame with the members of its camera that the layout lets out."""
    values = dict(row.values)
    numbers = {key: number_at(values[key], row.path, inside(row.where, key))
               for key in (*CAMERA, "camera_angle_x") if key in values}  # fmt: skip
    width, height, angle = (numbers.get(key) for key in ("w", "h", "camera_angle_x"))
    if width is not None and angle is not None and 0 < angle < np.pi:
        numbers.setdefault("fl_x", 0.5 * width / float(np.tan(0.5 * angle)))
    if "fl_x" in numbers and width is not None and height is not None:
        numbers.setdefault("fl_y", numbers["fl_x"])
        numbers.setdefault("cx", 0.5 * width)
        numbers.setdefault("cy", 0.5 * height)
    return replace(row, values=values | dict(numbers))


def named_files(records: Records, key: str, *endings: str) -> list[Path | None]:
    """The file that each frame names, with the first ending that is there."""
    files: list[Path | None] = []
    for row in records.rows:
        value = row.values.get(key)
        if value is None:
            files.append(None)
            continue
        name = text_at(value, row.path, inside(row.where, key))
        files.append(file_inside(row.path.parent, *(name + ending for ending in endings)))
    return files


NAME = "NeRFCapture"
FILES = "a folder with the app's transforms.json"
LACKS = "one pose per picture taken; no depth, no inertial data"
MARK = "depth_integer_scale"
"""A key that only this app writes."""


def detect(path: Path) -> bool:
    """Whether the folder's transforms.json (or the file) is this app's."""
    return mentions(log_of(path), "transform_matrix", MARK)


def read(path: Path) -> CaptureSession:
    """Read a session folder (or the transforms.json in it)."""
    log = log_of(path)
    records = read_frames(log)[1].ordered_by("timestamp")
    times = records.column("timestamp")
    T = poses_from_matrices(records.column("transform_matrix", 4, 4), records.place)
    check_poses(times, T, log, records.place)
    intrinsics, image_size, notes = cameras_of(records)
    images, image_times = stills(times, named_files(records, "file_path", ".png", ""))
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=image_size,
        video_times=image_times,
        images=images,
        notes=notes,
    )
