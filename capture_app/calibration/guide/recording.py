"""What a recording is good for: read, tracked, turned enough, at rest where it must be, with pictures."""

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.calibration.guide.finding import Finding, both
from ingest.calibration.hand_eye.hand_eye import check_turns
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.calibration.hand_eye.to_mount import phone_stream
from ingest.calibration.scan_mount import views_of
from ingest.calibration.still import CARRIED, clamped_stills
from ingest.session import CaptureSession
from ingest.trajectory.segments import check_rate, find_breaks
from omomo_core.errors import InputError

_SECOND_TURN = np.radians(10.0)
"""Turned less about a second direction, it says next to nothing of the place along the first."""
_ENOUGH = 15.0
"""Seconds of turning that a mount is well known from."""
_LOST = 0.2
"""Part of a recording that may be lost to breaks without a word."""
_MOST = 600
"""Poses that turns are measured with."""


def turned_recording(session: CaptureSession) -> Finding:
    """For a motion that another camera or tracker followed too.

    Raises:
        InputError: "rate-too-low", "calibration-tracking" or "calibration-turns".
    """
    check_rate(session)
    stream = phone_stream(session)
    check_turns(stream)
    whole, used = float(np.ptp(session.times)), float(np.ptp(stream.times))
    doubts: list[str] = []
    if used < min((1 - _LOST) * whole, _ENOUGH):
        doubts.append(
            f"Only {used:.0f} s without a break can be used. Record again where there is light and "
            "much to see, for 20 s or more, and move more slowly."
        )
    tracked = "without a break" if used > whole - 0.5 else f"without a break for {used:.0f} s"
    turns = turns_of(stream)
    return both(
        Finding(f"{_pace(session)}, tracked {tracked}", tuple(doubts)),
        turns,
    )


def turns_of(stream: PoseStream) -> Finding:
    """By how much the phone turned, and about how many directions."""
    R = Rotation.from_matrix(stream.T[:: max(1, len(stream.T) // _MOST), :3, :3])
    vectors = (R.mean().inv() * R).as_rotvec()
    axes = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)[2]
    first, second, _ = np.ptp(vectors @ axes.T, axis=0).tolist()
    if second > _SECOND_TURN:
        return Finding(
            f"turned by up to {np.degrees(first):.0f} deg, and by {np.degrees(second):.0f} about a "
            "second direction"
        )
    return Finding(
        f"turned by up to {np.degrees(first):.0f} deg",
        (
            "It turned about one direction only: where the object is along that direction stays "
            "open (its height, if it was pushed over the floor). Record again and also tilt it by 20 "
            "degrees in two directions; or go on, and let the floor tell the height.",
        ),
    )


def rested_recording(session: CaptureSession) -> Finding:
    """For a phone that was clamped while the log ran, with the object standing still.

    Raises:
        InputError: "rate-too-low" or "no-still".
    """
    return _rests(session, CARRIED)


def filmed_rest(session: CaptureSession) -> Finding:
    """For a clamped phone whose pictures at rest are looked for in a scan.

    Raises:
        InputError: "rate-too-low", "no-still", "scan-no-pictures" or "scan-no-camera".
    """
    rests = _rests(session, 0.0)
    stills, _ = clamped_stills(session)
    views = [view for still in stills for view in views_of(session, still).views]
    height, width = views[0].picture.shape
    return both(rests, Finding(f"{len(views)} pictures of {width} x {height} there"))


def pictured_recording(session: CaptureSession) -> Finding:
    """For a phone that filmed a board before it was clamped.

    Raises:
        InputError: of `rested_recording`, "no-intrinsics" or "no-video".
    """
    rests = rested_recording(session)
    if session.intrinsics is None:
        raise InputError(
            "no-intrinsics",
            f"{session.app} does not log the camera's focal length.",
            where=str(session.source),
            fix="Record with an app that does, such as Stray Scanner or 3D Scanner App.",
        )
    if session.video is None and not session.images:
        raise InputError(
            "no-video",
            "The recording holds no film and no pictures of the board.",
            where=str(session.source),
            fix="Record with an app that films while it logs, such as Stray Scanner.",
        )
    return rests


def _rests(session: CaptureSession, path: float) -> Finding:
    check_rate(session)
    stills, note = clamped_stills(session, path=path)
    rests_text = " and again ".join(f"from {still}" for still in stills)
    doubts = (note,) if note else ()
    if find_breaks(session).jumps.any():
        doubts += (
            "ARKit's tracking jumped during the recording: what lies on both sides of a jump may "
            "not fit together. Move more slowly, where there is light and much to see.",
        )
    return Finding(f"{_pace(session)}, the clamped phone rests {rests_text}", doubts)


def _pace(session: CaptureSession) -> str:
    """App, poses a second, seconds."""
    rate = 1 / float(np.median(np.diff(session.times)))
    return f"{session.app}, {rate:.0f} poses a second, {np.ptp(session.times):.0f} s"
