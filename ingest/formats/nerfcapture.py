"""NeRFCapture (offline): transforms.json and images/<i>.png.

ARKit's own axes and y-up world, though the file looks like nerfstudio's z-up one; the file names
have no ending, the frames are in the order in which they were written out. The depth images have
lost their range, so they are not read.
"""

from pathlib import Path

from ingest.formats.json_file import mentions
from ingest.formats.pictures import stills
from ingest.formats.poses import check_poses, poses_from_matrices
from ingest.formats.records import pinhole
from ingest.formats.transforms_json import (
    CAMERA,
    log_of,
    named_files,
    read_frames,
)
from ingest.session import CaptureSession

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
    intrinsics, image_size = pinhole(records, CAMERA)
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
    )
