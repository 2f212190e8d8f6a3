"""Streams for the solver from a phone's session, a board's track or a tracker's log, and the mount."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.board_place import BoardPlace
from ingest.calibration.board.board_track import BoardTrack, with_camera
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.hand_eye.hand_eye import HandEye, free_in_words, solve
from ingest.calibration.hand_eye.hand_eye_model import PHONE_SD, PoseStream
from ingest.calibration.still import refuse_slip
from ingest.formats.camera_poses import MAX_SECONDS, check_length, poses_from_quaternions
from ingest.formats.log_units import refuse_lengths
from ingest.formats.pose_columns import IN_ORDER, read_pose_rows
from ingest.formats.text_table import first_row, floats
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.segments import find_breaks
from ingest.uncertainty import between, of_inverse, of_product
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import inverse

_HALF_SECONDS = 8.0
"""A recording is halved to look for a slip if each half lasts this long."""


def calibrate_by_motion(
    phone: PoseStream,
    target: PoseStream,
    T_target_object: Float64[np.ndarray, "4 4"],
    target_object_covariance: Float64[np.ndarray, "6 6"],
    method: str,
) -> Mount:
    """The mount from a phone's log and another tracker's log of a target fixed to the object.

    The two halves of a recording that lasts long enough must give one mount.

    Args:
        phone: T_world_phone.
        target: T_camera_target.
        T_target_object: the object in the target's frame.
        target_object_covariance: of that.
        method: for the mount file.

    Raises:
        InputError: those of `solve`, and "mount-slipped".
    """
    found = solve(phone, target)
    _refuse_slip(phone, target, found)
    return Mount(
        found.T_phone_target @ T_target_object,
        method,
        covariance=of_product(
            found.T_phone_target, found.covariance, T_target_object, target_object_covariance
        ),
        residuals={
            "rms_mm": round(found.rms_mm, 3),
            "rms_deg": round(found.rms_deg, 4),
            "world held still_mm": round(found.rest_mm, 3),
            "world held still_deg": round(found.rest_deg, 4),
            "drift taken out_m": round(found.drift.metres, 4),
            "drift per metre walked_mm": round(1e3 * found.drift.per_metre, 2),
            "phone's lengths too short by_%": round(100 * found.scale, 2),
            "clock offset_s": round(found.offset, 4),
            "moments used_%": round(100 * float(found.kept.mean()), 1),
        },
        free=free_in_words(found.open),
    )


def _refuse_slip(phone: PoseStream, target: PoseStream, whole: HandEye) -> None:
    """Solve both halves by themselves, where they show enough, and compare."""
    if float(np.ptp(whole.times)) < 2 * _HALF_SECONDS:
        return
    middle = np.median(whole.times)
    halves = [
        _half(phone, target, target.times < middle),
        _half(phone, target, target.times >= middle),
    ]
    first, second = halves
    if first is not None and second is not None:
        refuse_slip(first, second)


def _half(phone: PoseStream, target: PoseStream, which: np.ndarray) -> Mount | None:
    covariance = None if target.covariance is None else target.covariance[which]
    try:
        found = solve(phone, PoseStream(target.times[which], target.T[which], covariance))
    except InputError:
        return None  # it shows too little by itself, and the whole has been solved
    return Mount(found.T_phone_target, "half", covariance=found.covariance)


_LEAST_SECONDS = 5.0
_PACE = 0.1
"""Seconds over which a pace is taken."""


def phone_stream(session: CaptureSession) -> PoseStream:
    """The longest stretch of a session in which tracking never broke.

    Raises:
        InputError: "calibration-tracking" when it is shorter than five seconds.
    """
    whole = np.concatenate([~find_breaks(session).any, [False]])
    stretches = [(a, b + 1) for a, b in runs(whole)]
    longest = max(
        stretches, key=lambda s: session.times[s[1] - 1] - session.times[s[0]], default=(0, 1)
    )
    a, b = longest
    seconds = float(session.times[b - 1] - session.times[a])
    if seconds < _LEAST_SECONDS:
        raise InputError(
            "calibration-tracking",
            f"ARKit tracked without a break for {seconds:.1f} s at most; the calibration needs "
            f"{_LEAST_SECONDS:g} s.",
            where=str(session.source),
            fix="Record again where there is light and much to see, and move more slowly.",
        )
    return PoseStream(session.times[a:b], session.T_world_phone[a:b])


def calibrate_by_board(phone: PoseStream, track: BoardTrack, place: BoardPlace) -> Mount:
    """The mount; errors of the camera's intrinsics, which all poses share, are in its covariance.

    Args:
        phone: T_world_phone of the clamped phone.
        track: of the board on the object.
        place: where the board is on the object.

    Raises:
        InputError: those of `calibrate_by_motion`.
    """
    T_board_object = inverse(place.T_object_board)
    mount = calibrate_by_motion(
        phone,
        stream_of(track),
        T_board_object,
        of_inverse(place.T_object_board, place.covariance),
        "board",
    )
    assert mount.covariance is not None
    shared = _of_intrinsics(phone, track, T_board_object)
    residuals = mount.residuals | {
        "corners_px": round(float(np.sqrt((track.rms**2).mean())), 3),
        "board place_mm": round(1e3 * place.rms, 3),
    }
    return replace(mount, covariance=mount.covariance + shared, residuals=residuals)


def stream_of(track: BoardTrack) -> PoseStream:
    """The board's poses in what rests: the camera, or the world of a phone that filmed it."""
    if track.T_world_camera is None:
        return PoseStream(track.times, track.T_camera_board, track.covariance)
    own = np.diag(PHONE_SD**2)
    pairs = zip(track.T_world_camera, track.T_camera_board, track.covariance, strict=True)
    covariance = np.stack([of_product(W, own, T, C) for W, T, C in pairs])
    return PoseStream(track.times, track.T_world_camera @ track.T_camera_board, covariance)


def _of_intrinsics(
    phone: PoseStream, track: BoardTrack, T_board_object: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "6 6"]:
    """Covariance of the mount from the uncertainty of focal length and principal point."""
    total = np.zeros((6, 6))
    if track.camera.sigmas is None:
        return total
    found = solve(phone, stream_of(track)).T_phone_target @ T_board_object
    for camera in _one_sigma_off(track.camera):
        other = solve(phone, stream_of(with_camera(track, camera)))
        step = between(found, other.T_phone_target @ T_board_object)
        total += np.outer(step, step)
    return total


def _one_sigma_off(camera: WitnessCamera) -> list[WitnessCamera]:
    """The focal lengths together, for they err together, and each number of the principal point."""
    assert camera.sigmas is not None
    fx, _, cx, cy = camera.sigmas
    zoom = 1 + fx / camera.fx
    return [
        replace(camera, fx=camera.fx * zoom, fy=camera.fy * zoom),
        replace(camera, cx=camera.cx + cx),
        replace(camera, cy=camera.cy + cy),
    ]


def read_pose_log(path: Path) -> PoseStream:
    """Read a tracker's log: TUM text, the same by commas, or a table whose header names the columns.

    Stamps and positions are read as `ingest.formats.pose_columns` reads those of sessions. Lines of # are
    comments; of two poses with one stamp the first counts.

    Raises:
        InputError: "poses-missing", "poses-few", "poses-order", and those of
            `ingest.formats.pose_columns.read_pose_rows` and
            `ingest.formats.camera_poses.poses_from_quaternions`.
    """
    if not path.is_file():
        raise InputError(
            "poses-missing", "There is no such file.", where=str(path), fix="Check the path."
        )
    by_commas = len(floats(first_row(path).split(","))) == IN_ORDER.width
    rows = read_pose_rows(path, replace(IN_ORDER, separator="," if by_commas else None))
    times = rows.clock.times
    if len(times) < 2:
        raise InputError("poses-few", "The file has no two poses.", where=str(path))
    back = np.flatnonzero(np.diff(times) < 0)
    if len(back):
        raise InputError(
            "poses-order",
            "The time runs backwards.",
            where=rows.place(int(back[0]) + 1),
            fix="Sort the lines by their time.",
        )
    if np.ptp(times) > MAX_SECONDS:
        check_length(times, path, rows.place)
    T = poses_from_quaternions(rows.positions, rows.xyzw, rows.place)
    new = np.concatenate([[True], np.diff(times) > 0])
    return PoseStream(times[new], T[new])


_SAME_TIME, _SAME_PLACE = 1e-4, 2e-4
"""Seconds and metres between two copies of one log, as their decimals round it; trackers are noisier."""
_SHARED = 0.9
"""Part of a log's poses that are the other's, where it is a copy or a cut of it."""


def refuse_own_log(session: CaptureSession, target: PoseStream, log: Path) -> None:
    """Refuse the phone's own log as that of another tracker.

    Its stamps and the way between its places are those of the session, whatever axes it was written with.

    Raises:
        InputError: "tracker-is-phone".
    """
    places = session.T_world_phone[:, :3, 3]
    for shift in (0.0, session.times[0] - target.times[0]):
        times = target.times + shift
        nearest = np.searchsorted(session.times, times - _SAME_TIME).clip(max=len(places) - 1)
        same = np.abs(session.times[nearest] - times) <= _SAME_TIME
        if same.mean() < _SHARED:
            continue
        own, other = places[nearest[same]], target.T[same, :3, 3]
        ways = [np.linalg.norm(p - p[0], axis=1) for p in (own, other)]
        if (np.abs(ways[0] - ways[1]) <= _SAME_PLACE).mean() >= _SHARED:
            raise InputError(
                "tracker-is-phone",
                f"{log.name} is the log of the phone itself: it has the stamps and the way of the session.",
                where=str(log),
                fix="Give what the other tracker logged of the object while the phone was clamped to it.",
            )


def refuse_other_lengths(phone: PoseStream, target: PoseStream, log: Path) -> None:
    """Refuse a tracker's log whose positions are not metres.

    Raises:
        InputError: "units-length".
    """
    (speed, turning), (other, _) = _paces(target), _paces(phone)
    refuse_lengths(speed, other, turning, str(log))


def _paces(
    stream: PoseStream,
) -> tuple[Float64[np.ndarray, " steps"], Float64[np.ndarray, " steps"]]:
    """Metres and radians a second over steps of about a tenth of a second."""
    times = np.arange(stream.times[0], stream.times[-1], _PACE)
    T = stream.at(times)
    step = between(T[:-1], T[1:]).reshape(-1, 2, 3) / _PACE
    turn, shift = np.linalg.norm(step, axis=-1).T
    return shift, turn
