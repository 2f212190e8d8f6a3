"""What came with the poses: gravity from the IMU, intrinsics, video."""

import av
import av.error
import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation, Slerp

from ingest.report.check import Check, grade
from ingest.session import R_CAMERA_DEVICE, CaptureSession, ImuLog

_WINDOW_SECONDS = 2.0


def gravity(session: CaptureSession) -> Check:
    """Whether the accelerometer, turned by the poses, points down."""
    if session.imu is None:
        return Check("gravity", "ok", "no accelerometer in the log: the axes are not checked")
    angles = gravity_angles(session, session.imu)
    if len(angles) == 0:
        return Check("gravity", "warn", "the accelerometer ran too short a time to check the axes")
    off = float(np.median(angles))
    severity = grade(off, 5.0, 15.0)
    return Check(
        "gravity",
        severity,
        f"the accelerometer agrees with the poses' down within {off:.1f} deg (median)",
        fix=""
        if severity == "ok"
        else "The log's axes are not the app's usual ones, or its "
        "clocks differ: check that the files belong to one take.",
    )


def gravity_angles(session: CaptureSession, imu: ImuLog) -> Float64[np.ndarray, " windows"]:
    """Angle in degrees between down and the mean world acceleration of each two seconds.

    Averaging in the world removes the phone's own acceleration: its velocity stays bounded.
    """
    inside = (imu.times >= session.times[0]) & (imu.times <= session.times[-1])
    times = imu.times[inside]
    if len(times) == 0:
        return np.empty(0)
    R_world_phone = Slerp(session.times, Rotation.from_matrix(session.T_world_phone[:, :3, :3]))
    world = R_world_phone(times).apply(imu.accel[inside] @ R_CAMERA_DEVICE.T)
    window = ((times - times[0]) // _WINDOW_SECONDS).astype(int)
    whole = [k for k in range(window[-1])] or [0]
    means = np.stack([world[window == k].mean(axis=0) for k in whole if (window == k).any()])
    down = -means[:, 1] / np.linalg.norm(means, axis=1)
    return np.degrees(np.arccos(np.clip(down, -1, 1)))


def intrinsics(session: CaptureSession) -> Check:
    """Whether the camera is known, for overlays and for calibrating the mount."""
    if session.intrinsics is None:
        return Check("intrinsics", "ok", "none: no overlay on the video")
    focal = session.intrinsics[:, 0]
    plausible = (session.intrinsics > 0).all() and np.ptp(focal) < 0.2 * focal.mean()
    return Check(
        "intrinsics",
        "ok" if plausible else "bad",
        f"fx {focal.min():.0f} to {focal.max():.0f} px",
        fix="" if plausible else "The log's camera columns are damaged: copy the session again.",
    )


def video(session: CaptureSession) -> Check:
    """Whether the video is there and has a frame per logged image (its header is read, no more)."""
    if session.video is None:
        return Check("video", "ok", "none: no overlay")
    try:
        with av.open(str(session.video)) as container:
            frames = container.streams.video[0].frames
    except (av.error.FFmpegError, IndexError) as problem:
        fix = "Copy the session from the phone again."
        return Check("video", "bad", f"{session.video.name} cannot be read: {problem}", fix=fix)
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
