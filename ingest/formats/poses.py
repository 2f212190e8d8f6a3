"""Checks and conversions every pose log needs, each failure naming the line or frame.

`place` gives the file and line (or frame) of a row, for messages: `Table.place`, or a function of
the format.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError

MIN_SECONDS = 1.0
MAX_SECONDS = 4 * 3600.0
MAX_METRES = 1e5
"""From the origin, along one axis; farther is another unit, or damage."""
_UNIT_TOLERANCE = 1e-3
_WILD = 9.0
"""No element of a rotation is near this size; squares of still larger ones might overflow."""
_FINER = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
PERIODS = 1 / 300, 1 / 8
"""Seconds between the poses of any app."""
_FIX_LOG = "Give the log as the app wrote it; if it is untouched, record the take again."

Place = Callable[[int], str]


def poses_from_quaternions(
    positions: Float64[np.ndarray, "frames 3"],
    quaternions: Float64[np.ndarray, "frames 4"],
    place: Place,
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses from positions and quaternions (xyzw) of length 1."""
    lengths = np.linalg.norm(quaternions.clip(-_WILD, _WILD), axis=1)
    off = np.abs(lengths - 1) > _UNIT_TOLERANCE
    if off.any():
        row = int(np.argmax(off))
        raise InputError(
            "pose-not-unit",
            f"The quaternion has length {lengths[row]:.4f} instead of 1.",
            where=place(row),
            fix=_FIX_LOG,
        )
    return _poses(Rotation.from_quat(quaternions).as_matrix(), positions)


def poses_from_matrices(
    matrices: Float64[np.ndarray, "frames rows 4"], place: Place
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses from [R | t], with or without the row 0 0 0 1.

    R is made exactly orthonormal (logs print six decimals).
    """
    faults = np.abs(matrices[:, 3:] - [0, 0, 0, 1]).max(axis=(1, 2), initial=0)
    if (faults > _UNIT_TOLERANCE).any():
        row = int(np.argmax(faults > _UNIT_TOLERANCE))
        last = " ".join(f"{x:.3g}" for x in matrices[row, 3])
        raise InputError(
            "pose-not-rigid",
            f"The last row of the matrix is {last} instead of 0 0 0 1: it is transposed, or no "
            "rigid transform.",
            where=place(row),
            fix="Write camera-to-world matrices row by row, the position in the last column.",
        )
    R = matrices[:, :3, :3].clip(-_WILD, _WILD)
    off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    # The determinant as a triple product: LAPACK's divides by pivots, however small.
    handed = (np.cross(R[:, 0], R[:, 1]) * R[:, 2]).sum(axis=1)
    off = np.maximum(off, np.abs(handed - 1))
    if (off > _UNIT_TOLERANCE).any():
        row = int(np.argmax(off > _UNIT_TOLERANCE))
        mirrored = abs(handed[row] + 1) < _UNIT_TOLERANCE
        fault = "it is mirrored (left-handed axes)" if mirrored else f"it is off by {off[row]:.2g}"
        raise InputError(
            "pose-not-rigid",
            f"The 3x3 part is no rotation: {fault}.",
            where=place(row),
            fix=_FIX_LOG,
        )
    return _poses(Rotation.from_matrix(R).as_matrix(), matrices[:, :3, 3])


def _poses(
    R: Float64[np.ndarray, "frames 3 3"], t: Float64[np.ndarray, "frames 3"]
) -> Float64[np.ndarray, "frames 4 4"]:
    T = np.tile(np.eye(4), (len(R), 1, 1))
    T[:, :3, :3] = R
    T[:, :3, 3] = t
    return T


def _check_far(T_world_phone: Float64[np.ndarray, "frames 4 4"], place: Place) -> None:
    # Absurd turns (1e308 rad) have become NaN here, which is not within any bound.
    far = ~(np.abs(T_world_phone[:, :3, 3]).max(axis=1) <= MAX_METRES)
    if far.any():
        row = int(np.argmax(far))
        raise InputError(
            "pose-far",
            f"The phone is {np.abs(T_world_phone[row, :3, 3]).max():.3g} m from the origin.",
            where=place(row),
            fix=f"Positions are metres. {_FIX_LOG}",
        )


def check_clock(times: Float64[np.ndarray, " rows"], place: Place) -> None:
    """Refuse time (seconds) that runs backwards; stamps may repeat, as rounded ones do."""
    stops = times[1:] < times[:-1]
    if stops.any():
        row = int(np.argmax(stops))
        raise InputError(
            "time-backwards",
            f"The clock runs backwards: it goes from {times[row]:.6f} s to {times[row + 1]:.6f} s.",
            where=place(row + 1),
            fix="Do not join or re-order logs: give one take as the app wrote it.",
        )


def check_length(times: Float64[np.ndarray, " frames"], log: Path, place: Place) -> None:
    """Refuse a log of fewer than two poses, less than a second or more than a day."""
    seconds = float(times[-1]) - float(times[0]) if len(times) else 0.0
    if len(times) >= 2 and MIN_SECONDS <= seconds <= MAX_SECONDS:
        return
    if seconds > MAX_SECONDS:
        raise _too_long(times, log, place)
    raise InputError(
        "log-short",
        f"{log.name} holds {len(times)} poses over {seconds:.2f} s; "
        f"a take needs at least {MIN_SECONDS:g} s.",
        where=place(len(times) - 1) if len(times) else str(log),
        fix="Record a longer take, or copy the session again if it was longer than this.",
    )


def _too_long(times: Float64[np.ndarray, " frames"], log: Path, place: Place) -> InputError:
    """Names the unit that makes an ordinary rate of poses of the stamps, where one does."""
    step = float(np.median(np.diff(times)))
    reason, fix = "a take has minutes", "Give one take, as the app wrote it."
    for unit, second in _FINER.items():
        if PERIODS[0] < step * second < PERIODS[1]:
            reason = f"stamps {step:.3g} apart look like {unit}"
            fix = f"Give the stamps in seconds: multiply them by {second:g}."
    return InputError(
        "log-long",
        f"{log.name} goes on for {np.ptp(times) / 3600:.3g} hours if its stamps are seconds; {reason}.",
        where=place(int(np.argmax(np.diff(times))) + 1),
        fix=fix,
    )


def check_poses(
    times: Float64[np.ndarray, " frames"],
    T_world_phone: Float64[np.ndarray, "frames 4 4"],
    log: Path,
    place: Place,
) -> None:
    """Refuse time (s) that does not advance, logs too short or long, and poses that are no track.

    Such are a tracker that never started, and positions (m) beyond any walk.
    """
    _check_far(T_world_phone, place)
    check_clock(times, place)
    check_length(times, log, place)
    if np.ptp(T_world_phone, axis=0).max() < 1e-6:
        at_origin = np.allclose(T_world_phone[0, :3, 3], 0)
        raise InputError(
            "tracking-never-started",
            f"All {len(T_world_phone)} poses are the same{' (the origin)' if at_origin else ''}: "
            "tracking never started.",
            where=str(log),
            fix="Use the back camera in a lit, textured room, move the phone until the app shows "
            "tracking, then record again.",
        )
