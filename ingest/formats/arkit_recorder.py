"""ARKitRecorder: one JSON file of a take, an object for each image under the image's name.

`"41007.023854.jpg": {cameraTransform, cameraIntrinsics, imageResolution, timeStamp, ...}`:
camera-to-world matrices and camera matrices row by row, ARKit's own axes and world, seconds since
boot. The objects stand in no order. The images lie beside the file, in the sensor's landscape.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import check_poses, from_matrices, one_size, poses_from_matrices
from ingest.formats.json_log import Records, mentions, named_records, nested
from ingest.formats.still_images import file_inside, stills
from ingest.formats.text_table import logs, only_log
from ingest.session import CaptureSession

NAME = "ARKitRecorder"
FILES = "the .json file of a take, or a folder with one and its images"
LACKS = "no tracking state, IMU, depth or video (single images)"


def detect(path: Path) -> bool:
    """Whether the file, or a .json file of the folder, has the app's keys."""
    return bool(logs(path, ("*.json",), _is_log))


def read(path: Path) -> CaptureSession:
    """Read the file of a take, or a folder that holds exactly one."""
    log = only_log(path, logs(path, ("*.json",), _is_log))
    records = named_records(log).ordered_by("timeStamp")
    times = records.column("timeStamp")
    T = poses_from_matrices(records.column("cameraTransform", 4, 4), records.place)
    check_poses(times, T, log, records.place)
    intrinsics, image_size = _cameras(records)
    images, image_times = stills(
        times, [file_inside(log.parent, row.where) for row in records.rows]
    )
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=image_size,
        images=images,
        video_times=image_times,
    )


def _is_log(file: Path) -> bool:
    return mentions(file, "cameraTransform", "timeStamp")


def _cameras(
    records: Records,
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """Intrinsics and the size of the images, where they are logged."""
    if not records.any_has("cameraIntrinsics"):
        return None, None
    sizes = nested(records, "imageResolution").columns(("width", "height"))
    K = from_matrices(records.column("cameraIntrinsics", 3, 3), records.place)
    return K, one_size(sizes, records.place)
