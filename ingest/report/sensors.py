"""What came with the poses for the eye: intrinsics and video."""

import av
import av.error
import numpy as np

from ingest.report.check import Check
from ingest.session import CaptureSession


def intrinsics(session: CaptureSession) -> Check:
    """Whether the camera is known and plausible, for overlays and for calibrating the mount."""
    if session.intrinsics is None:
        return Check("intrinsics", "ok", "none: no overlay on the video")
    focal = session.intrinsics[:, 0]
    message = f"fx {focal.min():.0f} to {focal.max():.0f} px"
    if not (session.intrinsics > 0).all() or np.ptp(focal) >= 0.2 * focal.mean():
        fix = "The log's camera columns are damaged: copy the session again."
        return Check("intrinsics", "warn", message, fix=fix)
    if session.image_size is not None:
        off = session.intrinsics[:, 2:].mean(axis=0) / session.image_size - 0.5
        if np.abs(off).max() > 0.1:
            return Check(
                "intrinsics",
                "warn",
                f"{message}; the centre is {off[0]:+.0%}, {off[1]:+.0%} off the middle of "
                f"{session.image_size[0]} x {session.image_size[1]} px",
                fix="They belong to a turned or cropped image: log the landscape sensor image.",
            )
    return Check("intrinsics", "ok", message)


def video(session: CaptureSession) -> Check:
    """Whether the video is there and has a frame per logged image (its header is read, no more)."""
    if session.video is None:
        return Check("video", "ok", "none: no overlay")
    try:
        with av.open(str(session.video)) as container:
            frames = container.streams.video[0].frames
    except (av.error.FFmpegError, IndexError) as problem:
        fix = "Copy the session from the phone again; the motion does not need it."
        return Check("video", "warn", f"{session.video.name} cannot be read: {problem}", fix=fix)
    wanted = len(session.times if session.video_times is None else session.video_times)
    # Stray Scanner stamps its first frame before zero, and some tools drop it.
    if frames in (0, wanted, wanted - 1):
        return Check("video", "ok", f"{session.video.name}, {frames or 'unknown number of'} frames")
    return Check(
        "video",
        "warn",
        f"{session.video.name} has {frames} frames, the log {wanted} images",
        fix="An overlay would run out of step; copy the session from the phone again.",
    )
