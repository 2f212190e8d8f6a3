"""Write a session as Record3D lays it out."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.formats.json_log import JsonObject
from ingest.formats.record3d import _TURNS, T_PORTRAIT_PHONE
from ingest.session import CaptureSession
from omomo_core.geometry.transforms import inverse
from tests.log_writers.images import write_images
from tests.log_writers.json_files import write_object


def write(session: CaptureSession, folder: Path) -> Path:
    """Write an unpacked .r3d without depth, in the world of its first frame; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    T_world_portrait = session.T_world_phone @ inverse(T_PORTRAIT_PHONE)
    T = inverse(T_world_portrait[0]) @ T_world_portrait
    poses = np.concatenate([Rotation.from_matrix(T[:, :3, :3]).as_quat(), T[:, :3, 3]], axis=1)
    values: JsonObject = {
        "cameraType": 1,
        "initPose": [0, 0, 0, 1, 0, 0, 0],
        "fps": round(1 / float(np.median(np.diff(session.times)))),
        "frameTimestamps": session.times.tolist(),
        "poses": poses.tolist(),
    }
    if session.intrinsics is not None and session.image_size is not None:
        height, width = session.image_size
        fy, fx, cy, flipped_cx = session.intrinsics.T
        K = np.stack([fx, fy, width - 1 - flipped_cx, cy], axis=1)
        first = [K[0, 0], 0, 0, 0, K[0, 1], 0, K[0, 2], K[0, 3], 1]
        values |= {"w": width, "h": height, "K": first, "perFrameIntrinsicCoeffs": K.tolist()}
    write_object(values, folder / "metadata")
    write_images(session, lambda i: folder / f"rgbd/{i}.jpg", session.image_turns - _TURNS)
    return folder
