"""Single images, depth maps and how sure those are, beside a log."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from ingest.session import CaptureSession, DepthLog
from omomo_core.errors import InputError

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MAX_SIDE = 4096


def load_millimetres(file: Path) -> Float32[np.ndarray, "height width"]:
    """Read a depth map in metres; 0 stays 0 (unknown).

    Raises:
        InputError: "depth-damaged" for anything else than such a PNG of a phone's size.
    """
    data = file.read_bytes()
    sides = [int.from_bytes(data[at : at + 4], "big") for at in (16, 20)]
    # Measured before it is decoded: a small file may hold an image that fills the memory.
    if data.startswith(_SIGNATURE) and 0 < min(sides) <= max(sides) <= _MAX_SIDE:
        depth = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
        if depth is not None and depth.ndim == 2 and depth.dtype == np.uint16:
            return depth.astype(np.float32) / np.float32(1000)
    raise InputError(
        "depth-damaged",
        f"{file.name} is no grey PNG with 16 bits a pixel, at most {_MAX_SIDE} a side.",
        where=str(file),
        fix="Copy the session from the phone again.",
    )


def save_millimetres(metres: Float32[np.ndarray, "height width"], file: Path) -> None:
    """Write what `load_millimetres` reads, up to 65.535 m."""
    millimetres = np.rint(metres * 1000).clip(0, 65535).astype(np.uint16)
    file.write_bytes(cv2.imencode(".png", millimetres)[1].tobytes())


def file_inside(folder: Path, *names: str) -> Path | None:
    """The first of these files that is there; a name that leads out of the folder is not."""
    for name in names:
        path = folder / name
        if os.path.isfile(path) and path.resolve().is_relative_to(folder.resolve()):
            return path
    return None


def stills(
    times: Float64[np.ndarray, " frames"], files: Sequence[Path | None]
) -> tuple[tuple[Path, ...] | None, Float64[np.ndarray, " images"] | None]:
    """`images` and `video_times` of a session, from the image of each frame where there is one."""
    there = [i for i, file in enumerate(files) if file is not None]
    images = tuple(file for file in files if file is not None)
    return (images, times[there]) if images else (None, None)


def depth_log_mm(
    times: Float64[np.ndarray, " frames"], files: Sequence[Path | None]
) -> DepthLog | None:
    """Depth maps in millimetres, from the file of each frame where there is one."""
    maps, map_times = stills(times, files)
    if maps is None or map_times is None:
        return None
    return DepthLog(map_times, maps, sure_loader(maps, load_millimetres))


Metres = Float32[np.ndarray, "height width"]
Confidence = UInt8[np.ndarray, "rows columns"]
_SMALL = 2
"""The highest confidence where it is counted 0, 1, 2 as ARKit does; else 255 is."""
_LOW = 42
"""The highest value of 255 that is low: Polycam writes the middle one of ARKit's levels as 54 or 127."""


def sure_loader(
    maps: Sequence[Path],
    load: Callable[[Path], Metres],
    confidence: Callable[[Path], Confidence | None] | None = None,
) -> Callable[[Path], Metres]:
    """Return a loader of depth maps that has 0 (unknown) where their confidence is the lowest.

    ARKit's lowest level is what the sensor saw by a mirror or beyond its range. Where other maps of a
    recording have their confidence, one without is not sure anywhere.

    Args:
        maps: all depth maps of a recording.
        load: reads one, metres.
        confidence: reads that of one; None finds the picture that apps write beside it.
    """
    read = confidence_of if confidence is None else confidence
    stated = any(read(file) is not None for file in maps[:: max(1, len(maps) // 16)])

    def loader(file: Path) -> Metres:
        metres = load(file)
        return sure(metres, read(file)) if stated else metres

    return loader


def confidence_of(depth: Path) -> Confidence | None:
    """The picture of the confidence of a depth map, in levels from 0 (least) to 2; None without one."""
    places = (
        depth.with_name(depth.name.replace("depth_", "conf_", 1)),
        depth.with_name(f"{depth.stem}.confidence.png"),
        depth.parent.parent / "confidence" / f"{depth.stem}.png",
    )
    for file in places:
        if file != depth and file.is_file():
            found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
            return None if found is None else levels_of(found)
    return None


def levels_of(confidence: np.ndarray) -> Confidence:
    """Confidence as an app writes it, in levels from 0 (least) to 2."""
    first = confidence if confidence.ndim == 2 else confidence[..., 0]
    if first.max(initial=0) <= _SMALL:
        return first.astype(np.uint8)
    part = first / np.iinfo(first.dtype).max * 255 if first.dtype != np.uint8 else first
    return np.where(part <= _LOW, 0, np.where(part < 192, 1, 2)).astype(np.uint8)


def sure(metres: Metres, confidence: Confidence | None) -> Metres:
    """The depth with 0 where its confidence is the lowest, or not known."""
    if confidence is None:
        return np.zeros_like(metres)
    height, width = metres.shape
    fitting = cv2.resize(confidence, (width, height), interpolation=cv2.INTER_NEAREST)
    return np.where(np.asarray(fitting) > 0, metres, np.float32(0))


def write_depth_mm(session: CaptureSession, target: Callable[[int], Path]) -> list[int]:
    """Write the depth maps in landscape as 16-bit PNG of millimetres; returns their poses."""
    if session.depth is None:
        return []
    depth = session.depth
    maps = _of_poses(session.times, depth.times, depth.files)
    for i, source in maps:
        landscape = np.rot90(depth.load(source), session.image_turns)
        save_millimetres(np.ascontiguousarray(landscape), _made(target(i)))
    return [i for i, _ in maps]


def _of_poses(
    times: Float64[np.ndarray, " frames"],
    file_times: Float64[np.ndarray, " files"],
    files: Sequence[Path],
) -> list[tuple[int, Path]]:
    """Each pose that has a file at its very time, and that file."""
    by_time = dict(zip(file_times.tolist(), files, strict=True))
    return [(i, by_time[t]) for i, t in enumerate(times.tolist()) if t in by_time]


def _made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
