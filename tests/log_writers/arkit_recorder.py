"""Write a session as ARKitRecorder lays it out."""

from pathlib import Path

from ingest.formats.camera_poses import to_matrix
from ingest.formats.json_log import JsonObject
from ingest.session import CaptureSession
from tests.log_writers.images import write_images
from tests.log_writers.json_files import write_object


def write(session: CaptureSession, folder: Path) -> Path:
    """Write omocap.json and, beside it, the images at the times of poses; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"{t:.6f}.jpg" for t in session.times]
    frames: JsonObject = {}
    for i, name in enumerate(names):
        frame: JsonObject = {"imageName": name, "timeStamp": float(session.times[i])}
        frame["cameraTransform"] = session.T_world_phone[i].tolist()
        if session.intrinsics is not None and session.image_size is not None:
            width, height = session.image_size
            frame["cameraIntrinsics"] = to_matrix(session.intrinsics[i])
            frame["imageResolution"] = {"width": width, "height": height}
        frames[name] = frame
    write_object(frames, folder / "omocap.json")
    write_images(session, lambda i: folder / names[i], session.image_turns)
    return folder
