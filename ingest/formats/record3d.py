"""Record3D: .r3d archives and folders, with their compressed depth.

The poses (quaternion xyzw, then position) belong to the image in OpenGL axes, in the world of the first
frame: it is not gravity that says what is up. The image is PORTRAIT; since 1.10.1 it is landscape where
the phone was held sideways. Our phone's frame is landscape, so poses of portrait images are turned by a
quarter, the intrinsics with them, and `image_turns` says that the images are still portrait. w and h
contradict K in some files: then K is right. In 2022 the app wrote poses, K, w, h and fps alone.
"""

import importlib
from functools import partial
from pathlib import Path
from typing import Protocol, cast, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64, UInt8

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
from ingest.formats.still_images import (
    file_inside,
    levels_of,
    stills,
    sure_loader,
)
from ingest.session import R_CAMERA_DEVICE, CaptureSession, DepthLog
from ingest.session_images import picture_size
from omomo_core.errors import InputError

_MAX_SIDE = 640
"""The larger side of Face ID's depth; LiDAR has 256."""

_SHAPES = (256, 192), (640, 480), (320, 240)
"""Rows and columns of upright maps of LiDAR and Face ID."""
_FIX = "Export the recording from the app again."


@runtime_checkable
class Lzfse(Protocol):
    """The part of the package pyliblzfse that is used."""

    error: type[Exception]

    def decompress(self, data: bytes, /) -> bytes:
        """The bytes that were compressed."""
        ...


def lzfse_depth(
    values: JsonObject, times: Float64[np.ndarray, " frames"], log: Path, *, landscape: bool
) -> DepthLog | None:
    """The maps rgbd/<i>.depth; None where there are none, or nothing to decompress them with.

    Args:
        values: the metadata, with the size `dw` x `dh` in newer versions.
        times: of the frames, seconds.
        log: the metadata file.
        landscape: whether images and maps are wider than high.
    """
    lzfse = _package()
    names = [f"rgbd/{i}.depth" for i in range(len(times))]
    maps, map_times = stills(times, [file_inside(log.parent, name) for name in names])
    if lzfse is None or maps is None or map_times is None:
        return None
    shape = _shape(values, log, landscape=landscape)
    confidence = partial(_confidence, landscape=landscape, lzfse=lzfse)
    load = partial(_load, shape=shape, landscape=landscape, lzfse=lzfse)
    return DepthLog(map_times, maps, sure_loader(maps, load, confidence))


def _shape(values: JsonObject, log: Path, *, landscape: bool) -> tuple[int, int] | None:
    """Rows and columns of the maps; None where the metadata do not say them."""
    if not {"dw", "dh"} <= values.keys():
        return None
    sides = [number_at(values[key], log, key) for key in ("dw", "dh")]
    if not all(1 <= side <= _MAX_SIDE for side in sides):
        what = f"Depth of {sides[0]:g} x {sides[1]:g} pixels is no phone's."
        raise InputError("depth-damaged", what, where=place(log, "dw, dh"), fix=_FIX)
    # As with w and h, converted files have them the wrong way round: the maps are as the images.
    shape = int(max(sides)), int(min(sides))
    return (shape[1], shape[0]) if landscape else shape


def _package() -> Lzfse | None:
    try:
        return cast(Lzfse, importlib.import_module("liblzfse"))
    except ImportError:
        return None


def _load(
    file: Path, *, shape: tuple[int, int] | None, landscape: bool, lzfse: Lzfse
) -> Float32[np.ndarray, "height width"]:
    raw = _unpacked(file, 4 * _MAX_SIDE**2 if shape is None else 4 * shape[0] * shape[1], lzfse)
    rows, columns = shape or _usual_shape(len(raw) // 4, landscape=landscape)
    if len(raw) != 4 * rows * columns:
        raise _damaged(file, f"it has {len(raw)} bytes instead of {4 * rows * columns}")
    metres = np.frombuffer(raw, dtype="<f4").reshape(rows, columns)
    return np.where(np.isfinite(metres), metres, np.float32(0))


def _unpacked(file: Path, size: int, lzfse: Lzfse) -> bytes:
    if file.stat().st_size > size + 1024:
        raise _damaged(file, f"it is larger than a map of {size} bytes")
    try:
        return lzfse.decompress(file.read_bytes())
    except lzfse.error as error:
        raise _damaged(file, "it cannot be decompressed") from error


def _confidence(
    depth: Path, *, landscape: bool, lzfse: Lzfse
) -> UInt8[np.ndarray, "rows columns"] | None:
    """ARKit's levels of a map in rgbd/<i>.conf, a byte a pixel; None where there are none."""
    file = depth.with_suffix(".conf")
    if not file.is_file():
        return None
    try:
        raw = _unpacked(file, _MAX_SIDE**2, lzfse)
    except InputError:
        return None
    shape = _usual_shape(len(raw), landscape=landscape)
    if shape[0] * shape[1] != len(raw):
        return None
    return levels_of(np.frombuffer(raw, np.uint8).reshape(shape))


def _usual_shape(pixels: int, *, landscape: bool) -> tuple[int, int]:
    """Rows and columns of a map with so many pixels; those of LiDAR where no phone has such a map."""
    tall, wide = next((s for s in _SHAPES if s[0] * s[1] == pixels), _SHAPES[0])
    return (wide, tall) if landscape else (tall, wide)


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
"""Quarter turns that bring the portrait image into landscape."""
_ALWAYS = ("poses", "K", "fps", "w", "h")
"""What every version writes."""
_NEWER = ("initPose", "cameraType", "perFrameIntrinsicCoeffs", "dw", "frameTimestamps")


def detect(path: Path) -> bool:
    """Whether the folder's metadata (or the file) has the app's keys."""
    log = _log(path)
    return mentions(log, *_ALWAYS) or any(mentions(log, "poses", key) for key in _NEWER)


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
    T_world_image = poses_from_quaternions(rows[:, 4:], rows[:, :4], where)
    check_poses(times, T_world_image, log, where)
    folder = log.parent
    names = [(f"rgbd/{i}.jpg", f"rgb/{i}.jpg", f"rgb/{i}.png") for i in range(len(rows))]
    images, image_times = stills(times, [file_inside(folder, *name) for name in names])
    stored, size = _camera(values, len(rows), log, images)
    landscape = size is not None and size[0] > size[1]
    intrinsics = stored
    if stored is not None and size is not None and not landscape:
        # Turning an image counter-clockwise takes its pixel (u, v) to (v, width - 1 - u).
        fx, fy, cx, cy = stored.T
        intrinsics = np.stack([fy, fx, cy, size[0] - 1 - cx], axis=1)
        size = size[1], size[0]
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T_world_image @ (np.eye(4) if landscape else T_PORTRAIT_PHONE),
        intrinsics=intrinsics,
        image_size=None if intrinsics is None else size,
        gravity_aligned=False,
        video_times=image_times,
        images=images,
        image_turns=0 if landscape else _TURNS,
        depth=lzfse_depth(values, times, log, landscape=landscape),
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
    values: JsonObject, count: int, log: Path, images: tuple[Path, ...] | None
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """Intrinsics and size of the images as they are stored; K is column by column.

    Raises:
        InputError: "record3d-turned" where the pictures lie otherwise than the camera says.
    """
    picture = None if images is None else picture_size(images[0])
    key = "perFrameIntrinsicCoeffs"
    if values.get(key):
        intrinsics = numbers_at(values[key], (count, 4), log, key)
    elif "K" in values:
        matrix = numbers_at(values["K"], (9,), log, "K").reshape(1, 3, 3).transpose(0, 2, 1)
        intrinsics = from_matrices(matrix, lambda _: place(log, "K")).repeat(count, axis=0)
    else:
        return None, picture
    size = _size(values, intrinsics[0, 2], intrinsics[0, 3], log)
    if picture is not None and (picture[0] > picture[1]) != (size[0] > size[1]):
        raise InputError(
            "record3d-turned",
            f"The images are {picture[0]} x {picture[1]} pixels, and the camera of the log is that of "
            f"{size[0]} x {size[1]}: images and poses do not belong together.",
            where=str(images[0] if images else log),
            fix="Give the recording as the app exported it, its images not turned.",
        )
    return intrinsics, size


def _size(values: JsonObject, cx: float, cy: float, log: Path) -> tuple[int, int]:
    """Width and height of the image, in the order that puts (cx, cy) near its middle."""
    w, h = (int(number_at(member(values, key, log), log, key)) for key in ("w", "h"))

    def off(size: tuple[int, int]) -> float:
        return abs(cx - size[0] / 2) + abs(cy - size[1] / 2)

    return min((w, h), (h, w), key=off)
