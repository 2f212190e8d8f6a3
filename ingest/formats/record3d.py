"""Record3D: .r3d archives and folders, with their compressed depth.

The poses (quaternion xyzw, then position) belong to the PORTRAIT image in OpenGL axes, in the world
of the first frame: it is not gravity that says what is up. Our phone's frame is landscape, so the
poses are turned by a quarter, the intrinsics with them, and `image_turns` says that the images are
still portrait. w and h contradict K in some files: then K is right.
"""

import importlib
from functools import partial
from pathlib import Path
from typing import Protocol, cast, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64

from ingest.formats.camera_poses import check_poses, from_matrices, poses_from_quaternions
from ingest.formats.json_log import (
    JsonObject,
    load_object,
    member,
    mentions,
    number_at,
    numbers_at,
    place,
)
from ingest.formats.still_images import file_inside, picture_size, stills
from ingest.session import R_CAMERA_DEVICE, CaptureSession, DepthLog
from omomo_core.errors import InputError

_MAX_SIDE = 640
"""The larger side of Face ID's depth; LiDAR has 256."""

_FIX = "Export the recording from the app again."


@runtime_checkable
class Lzfse(Protocol):
    """The part of the package pyliblzfse that is used."""

    error: type[Exception]

    def decompress(self, data: bytes, /) -> bytes:
        """The bytes that were compressed."""
        ...


def lzfse_depth(
    values: JsonObject, times: Float64[np.ndarray, " frames"], log: Path
) -> DepthLog | None:
    """The maps rgbd/<i>.depth; None where there are none, or nothing to decompress them with.

    Args:
        values: the metadata, with the size `dw` x `dh`.
        times: of the frames, seconds.
        log: the metadata file.
    """
    lzfse = _package()
    names = [f"rgbd/{i}.depth" for i in range(len(times))]
    maps, map_times = stills(times, [file_inside(log.parent, name) for name in names])
    if lzfse is None or maps is None or map_times is None:
        return None
    sides = [number_at(member(values, key, log), log, key) for key in ("dw", "dh")]
    if not all(1 <= side <= _MAX_SIDE for side in sides):
        what = f"Depth of {sides[0]:g} x {sides[1]:g} pixels is no phone's."
        raise InputError("depth-damaged", what, where=place(log, "dw, dh"), fix=_FIX)
    # As with w and h, converted files have them the wrong way round: the maps are portrait.
    shape = int(max(sides)), int(min(sides))
    return DepthLog(map_times, maps, partial(_load, shape=shape, lzfse=lzfse))


def _package() -> Lzfse | None:
    try:
        return cast(Lzfse, importlib.import_module("liblzfse"))
    except ImportError:
        return None


def _load(
    file: Path, *, shape: tuple[int, int], lzfse: Lzfse
) -> Float32[np.ndarray, "height width"]:
    size = 4 * shape[0] * shape[1]
    if file.stat().st_size > size + 1024:
        raise _damaged(file, f"it is larger than a map of {size} bytes")
    try:
        raw = lzfse.decompress(file.read_bytes())
    except lzfse.error as error:
        raise _damaged(file, "it cannot be decompressed") from error
    if len(raw) != size:
        raise _damaged(file, f"it has {len(raw)} bytes instead of {size}")
    metres = np.frombuffer(raw, dtype="<f4").reshape(shape)
    return np.where(np.isfinite(metres), metres, np.float32(0))


def _damaged(file: Path, why: str) -> InputError:
    what = f"The depth map {file.name} is damaged: {why}."
    return InputError("depth-damaged", what, where=str(file), fix=_FIX)


NAME = "Record3D"
FILES = "a .r3d file, or a folder with metadata and rgbd, or metadata.json and rgb"
LACKS = "not aligned with gravity; no inertial data; needs LiDAR"

T_PORTRAIT_PHONE = np.eye(4)
"""Maps the phone's (landscape camera) axes into those of the portrait image."""
T_PORTRAIT_PHONE[:3, :3] = R_CAMERA_DEVICE.T

_TURNS = 1
_OWN_KEYS = ("initPose", "cameraType", "perFrameIntrinsicCoeffs", "dw", "frameTimestamps")


def detect(path: Path) -> bool:
    """Whether the folder's metadata (or the file) has the app's keys."""
    log = _log(path)
    return any(mentions(log, "poses", key) for key in _OWN_KEYS)


def read(path: Path) -> CaptureSession:
    """Read an unpacked recording, or its metadata file.

    Depth is there when the optional package pyliblzfse is; the EXR files of an export are not read.
    """
    log = _log(path)
    values = load_object(log)

    def where(row: int) -> str:
        return place(log, f"frame {row}")

    rows = numbers_at(member(values, "poses", log), (None, 7), log, "poses").reshape(-1, 7)
    times = _times(values, len(rows), log)
    _refuse_front_camera(rows, log)
    T_world_portrait = poses_from_quaternions(rows[:, 4:], rows[:, :4], where)
    check_poses(times, T_world_portrait, log, where)
    intrinsics, image_size = _camera(values, len(rows), log)
    folder = log.parent
    names = [(f"rgbd/{i}.jpg", f"rgb/{i}.jpg", f"rgb/{i}.png") for i in range(len(rows))]
    images, image_times = stills(times, [file_inside(folder, *name) for name in names])
    if images is not None:
        _refuse_landscape(picture_size(images[0]) or (0, 0), images[0])
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T_world_portrait @ T_PORTRAIT_PHONE,
        intrinsics=intrinsics,
        image_size=image_size,
        gravity_aligned=False,
        video_times=image_times,
        images=images,
        image_turns=_TURNS,
        depth=lzfse_depth(values, times, log),
    )


def _log(path: Path) -> Path:
    if not path.is_dir():
        return path
    return next((path / n for n in ("metadata", "metadata.json") if (path / n).is_file()), path)


def _times(values: JsonObject, count: int, log: Path) -> Float64[np.ndarray, " frames"]:
    """Seconds: the stamps of newer versions, else even steps."""
    if values.get("frameTimestamps"):
        return numbers_at(values["frameTimestamps"], (count,), log, "frameTimestamps")
    fps = number_at(member(values, "fps", log), log, "fps")
    if fps <= 0:
        raise InputError(
            "log-damaged",
            f"{log.name} has fps {fps:g}.",
            where=place(log, "fps"),
            fix="Export the recording from the app again.",
        )
    return np.arange(count) / fps


def _refuse_front_camera(rows: Float64[np.ndarray, "frames 7"], log: Path) -> None:
    if len(rows) and np.abs(np.abs(rows) - [0, 0, 0, 1, 0, 0, 0]).max() < 1e-6:
        raise InputError(
            "front-camera",
            "All poses are the identity: the front (Face ID) camera records no motion.",
            where=str(log),
            fix="Record with the back LiDAR camera (choose LiDAR in Record3D's settings).",
        )


def _camera(
    values: JsonObject, count: int, log: Path
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """Intrinsics and image size, turned into landscape; K is column by column."""
    key = "perFrameIntrinsicCoeffs"
    if values.get(key):
        portrait = numbers_at(values[key], (count, 4), log, key)
    elif "K" in values:
        K = numbers_at(values["K"], (9,), log, "K").reshape(1, 3, 3).transpose(0, 2, 1)
        portrait = from_matrices(K, lambda _: place(log, "K")).repeat(count, axis=0)
    else:
        return None, None
    fx, fy, cx, cy = portrait.T
    width, height = _size(values, cx[0], cy[0], log)
    # Turning an image counter-clockwise takes its pixel (u, v) to (v, width - 1 - u).
    return np.stack([fy, fx, cy, width - 1 - cx], axis=1), (height, width)


def _size(values: JsonObject, cx: float, cy: float, log: Path) -> tuple[int, int]:
    """Width and height of the portrait image, in the order that puts (cx, cy) near its middle."""
    w, h = (int(number_at(member(values, key, log), log, key)) for key in ("w", "h"))

    def off(size: tuple[int, int]) -> float:
        return abs(cx - size[0] / 2) + abs(cy - size[1] / 2)

    size = min((w, h), (h, w), key=off)
    _refuse_landscape(size, log)
    return size


def _refuse_landscape(size: tuple[int, int], file: Path) -> None:
    if size[0] > size[1]:
        raise InputError(
            "record3d-landscape",
            f"The image is {size[0]} x {size[1]}, wider than high; Record3D writes portrait images "
            "and poses that belong to them.",
            where=str(file),
            fix="Give the recording as the app exported it, its images not turned.",
        )
