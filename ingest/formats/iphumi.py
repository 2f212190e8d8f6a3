"""iPhUMI: <recording>.json with poses and times, <recording>_rgb.mp4 beside it.

`poseTimes` are ISO 8601 texts (milliseconds), `poseTransforms` camera-to-world matrices row by
row: ARKit's own axes and world. One camera matrix for the whole take; `rgbTimes` are the times of
the images of the video, in its order.
"""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import check_poses, from_matrices, poses_from_matrices
from ingest.formats.json_log import (
    JsonObject,
    list_at,
    load_object,
    member,
    mentions,
    numbers_at,
    place,
    text_at,
)
from ingest.formats.text_table import logs, only_log
from ingest.session import CaptureSession
from omomo_core.errors import InputError

NAME = "iPhUMI"
FILES = "the .json file of a recording, or a folder with one"
LACKS = "no tracking state or IMU, one camera matrix for the take; its raw depth is not read"
IMAGE_SIZE = (1920, 1440)


def detect(path: Path) -> bool:
    """Whether the file, or a .json file of the folder, has the app's keys."""
    return bool(logs(path, ("*.json",), _is_log))


def read(path: Path) -> CaptureSession:
    """Read the file of a recording, or a folder that holds exactly one (one side)."""
    log = only_log(path, logs(path, ("*.json",), _is_log))
    recording = load_object(log)

    def where(row: int) -> str:
        return place(log, f"pose {row}")

    times = _times(recording, "poseTimes", log)
    matrices = member(recording, "poseTransforms", log)
    T = poses_from_matrices(numbers_at(matrices, (len(times), 4, 4), log, "poseTransforms"), where)
    check_poses(times, T, log, where)
    intrinsics = _intrinsics(recording, log)
    video = log.with_name(f"{log.stem}_rgb.mp4")
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=None if intrinsics is None else np.tile(intrinsics, (len(times), 1)),
        image_size=IMAGE_SIZE if intrinsics is not None else None,
        video=video if video.is_file() else None,
        video_times=_times(recording, "rgbTimes", log) if "rgbTimes" in recording else None,
    )


def _is_log(file: Path) -> bool:
    return mentions(file, "poseTimes", "poseTransforms")


def _intrinsics(recording: JsonObject, log: Path) -> Float64[np.ndarray, "4"] | None:
    key = "mainCameraIntrinsics"
    if key not in recording:
        return None
    matrix = numbers_at(recording[key], (3, 3), log, key)
    return from_matrices(matrix[None], lambda _: place(log, key))[0]


def _times(recording: JsonObject, key: str, log: Path) -> Float64[np.ndarray, " stamps"]:
    """Unix seconds of the texts under a key."""
    texts = list_at(member(recording, key, log), log, key)
    named = [(text_at(text, log, f"{key}[{i}]"), f"{key}[{i}]") for i, text in enumerate(texts)]
    return np.array([_seconds(text, place(log, name)) for text, name in named])


def _seconds(text: str, where: str) -> float:
    try:
        stamp = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            "log-damaged",
            f"{text[:40]!r} is no time like 2026-01-31T12:00:00.000Z.",
            where=where,
            fix="Copy the recording from the phone again; do not edit it.",
        ) from None
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
