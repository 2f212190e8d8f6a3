"""Write a session as AnySense lays it out."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession


def write(session: CaptureSession, folder: Path) -> Path:
    """Write AR_Pose_omocap.txt in the app's layout (times to the millisecond); returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    quaternions = Rotation.from_matrix(session.T_world_phone[:, :3, :3]).as_quat()
    poses = np.concatenate([quaternions, session.T_world_phone[:, :3, 3]], axis=1)
    lines = [
        f'"<{round(t * 1e3)}>" ,' + ",".join(f"{x:.9f}" for x in pose)
        for t, pose in zip(session.times, poses, strict=True)
    ]
    (folder / "AR_Pose_omocap.txt").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return folder
