"""Write a session as TUM lays it out."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA, opencv_poses
from ingest.session import CaptureSession


def write(session: CaptureSession, folder: Path) -> Path:
    """Write trajectory.txt with OpenCV axes and, if it is known, z up, and say so; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    aligned = opencv_poses(session.T_world_phone)
    T = aligned if session.gravity_aligned else session.T_world_phone @ T_OPENCV_ARKIT_CAMERA
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True)
    rows = np.concatenate([session.times[:, None], T[:, :3, 3], quaternions], axis=1)
    comments = ["# timestamp tx ty tz qx qy qz qw", "# axes: opencv"]
    comments += ["# up: z"] if session.gravity_aligned else []
    lines = [" ".join(f"{x:.9f}" for x in row) for row in rows]
    text = "\n".join([*comments, *lines, ""])
    (folder / "trajectory.txt").write_text(text, encoding="utf-8")
    return folder
