"""A simulated session on disk, as Stray Scanner lays it out, with its video."""

import tempfile
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from itertools import chain
from pathlib import Path

import av
import numpy as np
from jaxtyping import UInt8

from ingest.formats import stray_scanner
from ingest.session import CaptureSession

VIDEO_RATE = 60


def write_recording(
    session: CaptureSession,
    folder: Path,
    pictures: Iterable[UInt8[np.ndarray, "height width 3"]] | None = None,
) -> Path:
    """Write a session as Stray Scanner does; returns the folder.

    Args:
        session: as `simulate` makes it.
        folder: made if it is not there.
        pictures: one RGB picture per pose, in order, all of one size with even sides; any
            scale of the session's image size. None writes no video.

    Raises:
        ValueError: when there are not as many pictures as poses.
    """
    if pictures is None:
        return stray_scanner.write(session, folder)
    with tempfile.TemporaryDirectory() as temporary:
        video = Path(temporary) / "film.mp4"
        count = _encode(pictures, video)
        if count != len(session.times):
            raise ValueError(f"{count} pictures for {len(session.times)} poses")
        filmed = replace(session, video=video, video_times=session.times)
        return stray_scanner.write(filmed, folder)


def _encode(frames: Iterable[UInt8[np.ndarray, "height width 3"]], path: Path) -> int:
    """H.264 with the app's stamps (frame/60, whatever the real time); returns the frame count."""
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        return 0
    count = 0
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=VIDEO_RATE)
        stream.height, stream.width = first.shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.time_base = Fraction(1, VIDEO_RATE)
        stream.options = {"crf": "20", "preset": "veryfast"}
        for picture in chain([first], pictures):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts = count
            container.mux(stream.encode(frame))
            count += 1
        container.mux(stream.encode())
    return count
