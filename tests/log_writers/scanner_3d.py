"""Write a session as 3D Scanner App lays it out."""

from pathlib import Path

from ingest.formats.camera_poses import to_matrix
from ingest.formats.still_images import write_depth_mm
from ingest.session import CaptureSession
from tests.log_writers.images import write_images
from tests.log_writers.json_files import write_object


def write(session: CaptureSession, folder: Path) -> Path:
    """Write the session as the app does; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, (t, T) in enumerate(zip(session.times, session.T_world_phone, strict=True)):
        values = {"frame_index": i, "time": float(t), "cameraPoseARFrame": T.ravel().tolist()}
        if session.intrinsics is not None:
            values["intrinsics"] = [x for row in to_matrix(session.intrinsics[i]) for x in row]
        write_object(values, folder / f"frame_{i:05d}.json")
    write_images(session, lambda i: folder / f"frame_{i:05d}.jpg", session.image_turns)
    write_depth_mm(session, lambda i: folder / f"depth_{i:05d}.png")
    return folder
