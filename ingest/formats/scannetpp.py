"""ScanNet++, the iPhone's part of a scene: pose_intrinsic_imu.json and rgb.mkv in one folder.

`"frame_000000": {timestamp, pose, aligned_pose, intrinsic, imu}`: camera-to-world matrices and
camera matrices row by row. `pose` is ARKit's own, in a world that is y up, and is what is read;
`aligned_pose` is moved to the laser scan (OpenCV axes, z up). Image i of the video is frame i.
"""

from pathlib import Path

from ingest.formats.camera_poses import check_poses, from_matrices, poses_from_matrices
from ingest.formats.json_log import Records, mentions, named_records
from ingest.session import CaptureSession
from omomo_core.errors import InputError

NAME = "ScanNet++"
FILES = "the iphone folder of a scene, with pose_intrinsic_imu.json"
LACKS = "no tracking state; its IMU and its packed depth are not read"
IMAGE_SIZE = (1920, 1440)
_LOG = "pose_intrinsic_imu.json"


def detect(path: Path) -> bool:
    """Whether the file, or pose_intrinsic_imu.json of the folder, has poses of either kind."""
    log = _log(path)
    return any(mentions(log, _name(0), "timestamp", key) for key in ("pose", "aligned_pose"))


def read(path: Path) -> CaptureSession:
    """Read the iphone folder of a scene (or its pose_intrinsic_imu.json).

    Raises:
        InputError: "pose-missing" where a frame has `aligned_pose` alone; besides what every log
            is checked for.
    """
    log = _log(path)
    records = named_records(log)
    _refuse_aligned_alone(records)
    times = records.column("timestamp")
    T = poses_from_matrices(records.column("pose", 4, 4), records.place)
    check_poses(times, T, log, records.place)
    intrinsics = None
    if records.any_has("intrinsic"):
        intrinsics = from_matrices(records.column("intrinsic", 3, 3), records.place)
    video = log.parent / "rgb.mkv"
    return CaptureSession(
        app=NAME,
        source=path,
        times=times,
        T_world_phone=T,
        intrinsics=intrinsics,
        image_size=IMAGE_SIZE if intrinsics is not None else None,
        video=video if video.is_file() else None,
        video_times=times if video.is_file() else None,
    )


def _log(path: Path) -> Path:
    return path / _LOG if path.is_dir() else path


def _name(frame: int) -> str:
    return f"frame_{frame:06d}"


def _refuse_aligned_alone(records: Records) -> None:
    for i, row in enumerate(records.rows):
        if "pose" not in row.values and "aligned_pose" in row.values:
            raise InputError(
                "pose-missing",
                "The frame has only the pose aligned to the laser scan, not that of ARKit (pose).",
                where=records.place(i),
                fix="Give pose_intrinsic_imu.json as it was published.",
            )
