"""Write a session as ios_logger lays it out."""

import shutil
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.formats.ios_logger import _at
from ingest.session import GRAVITY, CaptureSession


def write(session: CaptureSession, folder: Path) -> Path:
    """Write the session as the app does (six decimals); returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    wxyz = Rotation.from_matrix(session.T_world_phone[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    poses = [session.times[:, None], session.T_world_phone[:, :3, 3], wxyz]
    _write_rows(folder / "ARposes.txt", np.concatenate(poses, axis=1))
    if session.intrinsics is not None:
        times = session.times if session.video_times is None else session.video_times
        K = _at(times, session.times, session.intrinsics)
        rows = [f"{t:.6f},{i}," + _fixed(k) for i, (t, k) in enumerate(zip(times, K, strict=True))]
        _write_lines(folder / "Frames.txt", rows)
    if session.imu is not None:
        stamps = session.imu.times[:, None]
        _write_rows(folder / "Accel.txt", np.hstack([stamps, session.imu.accel / GRAVITY]))
        _write_rows(folder / "Gyro.txt", np.hstack([stamps, session.imu.gyro]))
    if session.video is not None:
        shutil.copyfile(session.video, folder / "Frames.m4v")
    return folder


def _write_rows(path: Path, rows: Float64[np.ndarray, "rows columns"]) -> None:
    _write_lines(path, [_fixed(row) for row in rows])


def _write_lines(path: Path, lines: list[str]) -> None:
    path.write_text("".join(f"{line}\r\n" for line in lines), encoding="utf-8", newline="")


def _fixed(row: Float64[np.ndarray, " numbers"]) -> str:
    return ",".join(f"{x:.6f}" for x in row)
