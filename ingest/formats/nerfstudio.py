"""nerfstudio and instant-ngp: transforms.json, posed images in a z-up world.

OpenGL camera axes, which are ARKit's. `applied_transform` (3x4), where there is one, is what the
writer did to the poses of its source: undone, a session that came from ARKit is in its own world
again. `applied_scale` is by what it multiplied positions afterwards, as nerfstudio's own readers have it.
The layout has no time: frames must carry "timestamp" (seconds), or the file "fps".
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats import nerfcapture
from ingest.formats.camera_poses import check_poses, poses_from_matrices
from ingest.formats.json_log import (
    JsonObject,
    Records,
    list_at,
    mentions,
    number_at,
    numbers_at,
    place,
)
from ingest.formats.log_units import Clock, read_clock
from ingest.formats.nerfcapture import cameras_of, log_of, named_files, read_frames
from ingest.formats.still_images import depth_log_mm, stills
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse, shortest_turn

NAME = "nerfstudio"
FILES = 'a folder with transforms.json that has "timestamp" in each frame, or "fps"'
LACKS = "no times of its own; metres and z up are taken on trust; no inertial data"

_NO_METRES = ("colmap_im_id", "sharpness")
"""Keys that the COLMAP converters of nerfstudio and instant-ngp leave in each frame."""


def detect(path: Path) -> bool:
    """Whether the folder's transforms.json (or the file) has posed images of no other app."""
    log = log_of(path)
    return mentions(log, "transform_matrix", "frames") and not nerfcapture.detect(log)


def read(path: Path) -> CaptureSession:
    """Read a folder with transforms.json, or that file."""
    log = log_of(path)
    top, records = read_frames(log)
    _refuse_no_metres(log, records)
    clock, records = _times(top, records, log)
    times = clock.times
    T_saved_phone = poses_from_matrices(records.column("transform_matrix", 4, 4), records.place)
    T_saved_phone[:, :3, 3] /= _applied_scale(top, log)
    T = _T_world_saved(top, log) @ T_saved_phone
    check_poses(times, T, log, records.place)
    intrinsics, image_size, notes = cameras_of(records)
    images, image_times = stills(times, named_files(records, "file_path", "", ".png", ".jpg"))
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=image_size,
        video_times=image_times,
        images=images,
        depth=depth_log_mm(times, named_files(records, "depth_file_path", "")),
        notes=(*clock.notes, *notes),
    )


def _refuse_no_metres(log: Path, records: Records) -> None:
    if any(records.any_has(key) for key in _NO_METRES):
        raise InputError(
            "session-no-metres",
            f"{log.name} comes from COLMAP, which knows neither metres nor gravity.",
            where=str(log),
            fix="Give a session of an ARKit app, or a transforms.json made from one.",
        )


def _times(top: JsonObject, records: Records, log: Path) -> tuple[Clock, Records]:
    """Seconds of the frames, and the frames in that order."""
    if records.any_has("timestamp"):
        ordered = records.ordered_by("timestamp")
        return read_clock(ordered.column("timestamp"), None, ordered.place), ordered
    if "fps" not in top:
        raise InputError(
            "log-no-times",
            f"{log.name} does not say when its images were taken.",
            where=str(log),
            fix='Add "timestamp" (seconds) to each frame, or "fps" at the top of the file if the '
            "frames are in order and evenly spaced.",
        )
    fps = number_at(top["fps"], log, "fps")
    if fps <= 0:
        raise InputError(
            "log-damaged", f"fps is {fps:g}.", where=place(log, "fps"), fix="Give frames a second."
        )
    return Clock(np.arange(len(records.rows)) / fps), records


def _applied_scale(top: JsonObject, log: Path) -> float:
    key = "applied_scale"
    scale = number_at(top.get(key, 1.0), log, key)
    if scale <= 0:
        raise InputError(
            "log-damaged",
            f"{key} is {scale:g}; positions were multiplied by a number above 0.",
            where=place(log, key),
            fix=f"Give {key} as the program that made the file wrote it.",
        )
    return scale


def _T_world_saved(top: JsonObject, log: Path) -> Float64[np.ndarray, "4 4"]:
    """Maps the file's z-up world into the y-up one of its source, or simply into a y-up one."""
    T_saved_source = np.eye(4)
    if "applied_transform" in top:
        name, value = "applied_transform", top["applied_transform"]
        rows = 4 if len(list_at(value, log, name)) == 4 else 3
        matrix = numbers_at(value, (rows, 4), log, name)
        T_saved_source = poses_from_matrices(matrix[None], lambda _: place(log, name))[0]
    up = T_saved_source[2, :3]
    T_world_source = np.eye(4)
    T_world_source[:3, :3] = shortest_turn(up, np.array([0.0, 1.0, 0.0]))
    return T_world_source @ inverse(T_saved_source)
