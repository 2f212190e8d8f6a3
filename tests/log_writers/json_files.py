"""JSON as the apps write it."""

import json
from collections.abc import Mapping
from pathlib import Path

from ingest.formats.json_log import JsonObject
from ingest.formats.nerfcapture import CAMERA
from ingest.session import CaptureSession


def write_object(values: Mapping[str, object], path: Path) -> None:
    """Write a JSON object; its numbers come back exactly."""
    path.write_text(json.dumps(values, allow_nan=False) + "\n", encoding="utf-8")


def written_frames(session: CaptureSession) -> list[JsonObject]:
    """A frame with its time and camera for each pose."""
    frames: list[JsonObject] = [{"timestamp": float(t)} for t in session.times]
    if session.intrinsics is not None and session.image_size is not None:
        for frame, K in zip(frames, session.intrinsics.tolist(), strict=True):
            frame |= dict(zip(CAMERA, [*K, *session.image_size], strict=True))
    return frames
