"""write_stray: a simulated session on disk, with its video when there are pictures."""

from collections.abc import Iterable
from fractions import Fraction
from itertools import chain
from pathlib import Path

import av
import numpy as np
from jaxtyping import UInt8

from ingest.formats import stray_scanner
from ingest.session import CaptureSession

VIDEO_RATE = 60


def write_stray(
    session: CaptureSession,
    folder: Path,
    video_frames: Iterable[UInt8[np.ndarray, "height width 3"]] | None,
) -> Path:
    """Write a Stray Scanner folder; returns it.

    Args:
        session: as `simulate` makes it.
        folder: made if it is not there.
        video_frames: one RGB picture per pose, in order, all of one size with even sides; any
            scale of the session's image size. None writes no video.

    Raises:
        ValueError: when there are not as many pictures as poses.
    """
    stray_scanner.write(session, folder)
    if video_frames is not None:
        count = _encode(video_frames, folder / "rgb.mp4")
        if count != len(session.times):
            raise ValueError(f"{count} pictures for {len(session.times)} poses")
    return folder


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
