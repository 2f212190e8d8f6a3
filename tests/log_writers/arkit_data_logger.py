"""Write a session as ARKit Data Logger lays it out."""

from pathlib import Path

from ingest.session import CaptureSession


def write(session: CaptureSession, folder: Path) -> Path:
    """Write ARKit_camera_pose.txt as the app does (six decimals); returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["# Created by omocap "]
    for t, T in zip(session.times, session.T_world_phone, strict=True):
        row = " ".join(f"{x:.6f}" for x in T[:3].ravel())
        lines.append(f"{round(t * 1e9)} {row} ")
    (folder / "ARKit_camera_pose.txt").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return folder
