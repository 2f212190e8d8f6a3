"""Write a session as NeRFCapture lays it out."""

from pathlib import Path

from ingest.formats.nerfcapture import CAMERA, FILE, MARK
from ingest.session import CaptureSession
from tests.log_writers.images import write_images
from tests.log_writers.json_files import write_object, written_frames


def write(session: CaptureSession, folder: Path) -> Path:
    """Write the session as the app does; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    frames = written_frames(session)
    write_images(session, lambda i: folder / f"images/{i}.png", session.image_turns)
    for i, (frame, T) in enumerate(zip(frames, session.T_world_phone, strict=True)):
        frame |= {"file_path": f"images/{i}", "transform_matrix": T.tolist()}
    camera = {key: frames[0][key] for key in CAMERA if key in frames[0]}
    write_object({**camera, MARK: 1.0, "frames": frames}, folder / FILE)
    return folder
