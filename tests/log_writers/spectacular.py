"""Write a session as Spectacular AI lays it out."""

import json
import shutil
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA, at_times, opencv_poses
from ingest.formats.json_log import JsonObject
from ingest.formats.spectacular import CAMERA
from ingest.session import R_CAMERA_DEVICE, CaptureSession
from tests.log_writers.json_files import write_object

_T_CAMERA_DEVICE = np.eye(4)
_T_CAMERA_DEVICE[:3, :3] = T_OPENCV_ARKIT_CAMERA[:3, :3] @ R_CAMERA_DEVICE
"""imuToCamera of an IMU in the optical centre with the axes of the device, as we write it."""


def write(session: CaptureSession, folder: Path) -> Path:
    """Write poses (as ground truth), times and intrinsics of images, calibration and video."""
    folder.mkdir(parents=True, exist_ok=True)
    T_world_imu = opencv_poses(session.T_world_phone) @ _T_CAMERA_DEVICE
    camera: JsonObject = {"imuToCamera": _T_CAMERA_DEVICE.tolist(), "model": "pinhole"}
    if session.intrinsics is not None and session.image_size is not None:
        camera |= _camera(session.intrinsics[0])
        camera |= dict(zip(CAMERA[4:], session.image_size, strict=True))
    write_object({"cameras": [camera]}, folder / "calibration.json")
    lines = [*_pose_lines(session.times, T_world_imu), *_frame_lines(session)]
    text = "".join(f"{json.dumps(line, allow_nan=False)}\n" for line in lines)
    (folder / "data.jsonl").write_text(text, encoding="utf-8")
    if session.video is not None:
        shutil.copyfile(session.video, folder / "data.mov")
    return folder


def _camera(intrinsics: Float64[np.ndarray, "4"]) -> dict[str, object]:
    return dict(zip(CAMERA[:4], intrinsics.tolist(), strict=True))


def _pose_lines(
    times: Float64[np.ndarray, " frames"], T_world_imu: Float64[np.ndarray, "frames 4 4"]
) -> list[JsonObject]:
    quaternions = Rotation.from_matrix(T_world_imu[:, :3, :3]).as_quat().tolist()
    lines: list[JsonObject] = []
    for t, p, q in zip(times.tolist(), T_world_imu[:, :3, 3].tolist(), quaternions, strict=True):
        pose = {"position": dict(zip("xyz", p, strict=True))}
        pose["orientation"] = dict(zip("xyzw", q, strict=True))
        lines.append({"groundTruth": pose, "time": t})
    return lines


def _frame_lines(session: CaptureSession) -> list[JsonObject]:
    """An image line for each of `video_times`, with its intrinsics."""
    if session.video_times is None:
        return []
    frames: list[JsonObject] = [{"cameraInd": 0} for _ in session.video_times]
    if session.intrinsics is not None:
        K = at_times(session.video_times, session.times, session.intrinsics)
        for frame, k in zip(frames, K, strict=True):
            frame["cameraParameters"] = _camera(k)
    return [
        {"frames": [frame], "number": i, "time": float(session.video_times[i])}
        for i, frame in enumerate(frames)
    ]
