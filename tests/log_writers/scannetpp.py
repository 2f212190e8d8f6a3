"""Write a session as ScanNet++ lays it out."""

import shutil
from pathlib import Path

from ingest.formats.camera_poses import opencv_poses, to_matrix
from ingest.formats.json_log import JsonObject
from ingest.formats.scannetpp import _LOG, _name
from ingest.session import CaptureSession
from tests.log_writers.json_files import write_object


def write(session: CaptureSession, folder: Path) -> Path:
    """Write poses of both kinds, the world as it is, and the video; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    aligned = opencv_poses(session.T_world_phone)
    frames: JsonObject = {}
    for i, T in enumerate(session.T_world_phone):
        frame: JsonObject = {"timestamp": float(session.times[i]), "pose": T.tolist()}
        frame["aligned_pose"] = aligned[i].tolist()
        if session.intrinsics is not None:
            frame["intrinsic"] = to_matrix(session.intrinsics[i])
        frames[_name(i)] = frame
    write_object(frames, folder / _LOG)
    if session.video is not None:
        shutil.copyfile(session.video, folder / "rgb.mkv")
    return folder
