"""Write a session as CSV poses lays it out."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession


def write(session: CaptureSession, folder: Path) -> Path:
    """Write poses.csv with ARKit's axes, and say so; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    T = session.T_world_phone
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True)
    rows = np.concatenate([session.times[:, None], T[:, :3, 3], quaternions], axis=1)
    comments = ["# axes: arkit", *(["# up: y"] if session.gravity_aligned else [])]
    lines = [",".join(f"{x:.9f}" for x in row) for row in rows]
    text = "\n".join([*comments, "timestamp,x,y,z,qx,qy,qz,qw", *lines, ""])
    (folder / "poses.csv").write_text(text, encoding="utf-8")
    return folder
