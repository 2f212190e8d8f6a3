"""Write a session as ScanCapture lays it out."""

import shutil
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession


def write(session: CaptureSession, folder: Path) -> Path:
    """Write the session as the app does; returns the folder.

    Size and intrinsics of a camera that is not known are written as 0, and so is the exposure.
    """
    folder.mkdir(parents=True, exist_ok=True)
    frames = len(session.times)
    quaternions = Rotation.from_matrix(session.T_world_phone[:, :3, :3]).as_quat()
    poses = np.concatenate([session.T_world_phone[:, :3, 3], quaternions], axis=1)
    known = session.intrinsics is not None and session.image_size is not None
    width, height = session.image_size if known and session.image_size else (0, 0)
    K = session.intrinsics if known and session.intrinsics is not None else np.zeros((frames, 4))
    ok = np.ones(frames, bool) if session.tracking_ok is None else session.tracking_ok
    lines = [
        f"{round(t * 1e6)}, {'normal' if good else 'unknown'}, {_fixed(pose)}, {width}, {height}, "
        f"{_fixed(k)}, 0"
        for t, good, pose, k in zip(session.times, ok, poses, K, strict=True)
    ]
    header = "# timestamp, status, tx, ty, tz, qx, qy, qz, qw, w, h, fx, fy, cx, cy, exposure"
    (folder / "poses.txt").write_text("\n".join([header, *lines, ""]), encoding="utf-8")
    if session.video is not None:
        shutil.copyfile(session.video, folder / "images.mp4")
    _write_depth(session, folder / "depth")
    return folder


def _write_depth(session: CaptureSession, folder: Path) -> None:
    if session.depth is None:
        return
    folder.mkdir(exist_ok=True)
    for t, file in zip(session.depth.times, session.depth.files, strict=True):
        metres = np.rot90(session.depth.load(file), session.image_turns)
        save_metres(metres, folder / f"{round(t * 1e6)}.bin")


def _fixed(row: Float64[np.ndarray, " numbers"]) -> str:
    return ", ".join(f"{x:.9f}" for x in row)


def save_metres(metres: Float32[np.ndarray, "height width"], file: Path) -> None:
    """Write what `load_metres` reads."""
    file.write_bytes(metres.astype("<f4").tobytes())
