"""Write a session as nerfstudio lays it out."""

from pathlib import Path

from ingest.formats.nerfcapture import FILE
from ingest.formats.nerfstudio import _T_world_saved
from ingest.formats.still_images import write_depth_mm
from ingest.session import CaptureSession
from omomo_core.geometry.transforms import inverse
from tests.log_writers.images import write_images
from tests.log_writers.json_files import write_object, written_frames

_IMAGE, _DEPTH = "images/frame_{:05d}.png", "depth/frame_{:05d}.png"


def write(session: CaptureSession, folder: Path) -> Path:
    """Write transforms.json in a z-up world, with a timestamp in each frame; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    frames = written_frames(session)
    write_images(session, lambda i: folder / _IMAGE.format(i), session.image_turns)
    T_saved_world = inverse(_T_world_saved({}, folder))
    for i, (frame, T) in enumerate(zip(frames, session.T_world_phone, strict=True)):
        frame["file_path"] = _IMAGE.format(i)
        frame["transform_matrix"] = (T_saved_world @ T).tolist()
    for i in write_depth_mm(session, lambda i: folder / _DEPTH.format(i)):
        frames[i]["depth_file_path"] = _DEPTH.format(i)
    write_object({"camera_model": "OPENCV", "frames": frames}, folder / FILE)
    return folder
