"""Write a session as ARKitScenes lays it out."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.formats.arkitscenes import DEPTH, IMAGES, INTRINSICS
from ingest.formats.camera_poses import opencv_poses
from ingest.formats.still_images import write_depth_mm
from ingest.session import CaptureSession
from omomo_core.geometry.transforms import inverse
from tests.log_writers.images import write_images


def write(session: CaptureSession, folder: Path) -> Path:
    """Write trajectory and intrinsics, images and depth at the times of poses, as a scene."""
    folder.mkdir(parents=True, exist_ok=True)
    T_camera_world = inverse(opencv_poses(session.T_world_phone))
    turns = Rotation.from_matrix(T_camera_world[:, :3, :3]).as_rotvec()
    rows = np.concatenate([session.times[:, None], turns, T_camera_world[:, :3, 3]], axis=1)
    lines = [" ".join(f"{x:.9f}" for x in row) for row in rows]
    (folder / "lowres_wide.traj").write_text("\n".join([*lines, ""]), encoding="utf-8")
    if session.intrinsics is not None and session.image_size is not None:
        (folder / INTRINSICS).mkdir(exist_ok=True)
        for t, k in zip(session.times, session.intrinsics, strict=True):
            line = " ".join([*map(str, session.image_size), *(f"{x:.9f}" for x in k)])
            (folder / INTRINSICS / f"omocap_{t:.6f}.pincam").write_text(
                f"{line}\n", encoding="utf-8"
            )

    def target(kind: str) -> Callable[[int], Path]:
        return lambda i: folder / kind / f"omocap_{session.times[i]:.6f}.png"

    write_images(session, target(IMAGES), session.image_turns)
    write_depth_mm(session, target(DEPTH))
    return folder
