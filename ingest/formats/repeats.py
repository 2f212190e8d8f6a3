"""Poses that share a time stamp: loggers sometimes write a line twice, and rounding makes stamps equal."""

from dataclasses import replace

import numpy as np

from ingest.session import CaptureSession


def without_repeats(session: CaptureSession) -> CaptureSession:
    """Return the session with the first pose of each time stamp, and a note that counts the others."""
    new = np.concatenate([[True], np.diff(session.times) > 0])
    left_out = int((~new).sum())
    if left_out == 0:
        return session
    K, ok = session.intrinsics, session.tracking_ok
    poses = "pose has the stamp of the pose" if left_out == 1 else "poses have the stamps of those"
    return replace(
        session,
        times=session.times[new],
        T_world_phone=session.T_world_phone[new],
        intrinsics=None if K is None else K[new],
        tracking_ok=None if ok is None else ok[new],
        notes=(*session.notes, f"{left_out} {poses} before; only the first of each stamp counts."),
    )
