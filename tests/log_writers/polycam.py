"""Write a session as Polycam lays it out."""

from pathlib import Path

from ingest.formats.polycam import CAMERA, MATRIX
from ingest.formats.still_images import write_depth_mm
from ingest.session import CaptureSession
from tests.log_writers.images import write_images
from tests.log_writers.json_files import write_object


def write(session: CaptureSession, folder: Path) -> Path:
    """Write the session as the app does before its optimisation; returns the folder."""
    keyframes = folder / "keyframes"
    (keyframes / "cameras").mkdir(parents=True, exist_ok=True)
    names = [str(round(t * 1e6)) for t in session.times]
    for i, name in enumerate(names):
        values = dict(zip(MATRIX, session.T_world_phone[i, :3].ravel().tolist(), strict=True))
        if session.intrinsics is not None and session.image_size is not None:
            camera = [*session.intrinsics[i].tolist(), *session.image_size]
            values |= dict(zip(CAMERA, camera, strict=True))
        write_object(values, keyframes / "cameras" / f"{name}.json")
    write_images(session, lambda i: keyframes / f"images/{names[i]}.jpg", session.image_turns)
    write_depth_mm(session, lambda i: keyframes / f"depth/{names[i]}.png")
    return folder
