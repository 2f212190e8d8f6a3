"""Write a session as iPhUMI lays it out."""

import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

from ingest.formats.camera_poses import to_matrix
from ingest.formats.json_log import JsonObject
from ingest.session import CaptureSession
from tests.log_writers.json_files import write_object

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def write(session: CaptureSession, folder: Path) -> Path:
    """Write omocap.json (times to the millisecond, the first intrinsics) and the video."""
    folder.mkdir(parents=True, exist_ok=True)
    video_times = [] if session.video_times is None else session.video_times
    recording: JsonObject = {
        "formatVersion": "v1",
        "poseTimes": [_iso(t) for t in session.times],
        "poseTransforms": session.T_world_phone.tolist(),
        "rgbTimes": [_iso(t) for t in video_times],
        "hasRGB": session.video is not None,
        "hasDepth": False,
    }
    if session.intrinsics is not None:
        recording["mainCameraIntrinsics"] = to_matrix(session.intrinsics[0])
    write_object(recording, folder / "omocap.json")
    if session.video is not None:
        shutil.copyfile(session.video, folder / "omocap_rgb.mp4")
    return folder


def _iso(t: float) -> str:
    stamp = _EPOCH + timedelta(milliseconds=round(t * 1e3))
    return stamp.isoformat(timespec="milliseconds").replace("+00:00", "Z")
