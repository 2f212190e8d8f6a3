"""Camera poses of any log in ARKit's axes, with checks and intrinsics.

`place` gives the file and line (or frame) of a row, for messages: `NumberTable.place`, or a function of
the format.
"""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.axes import T_OPENCV_ARKIT_CAMERA, T_ZUP_ARKIT
from ingest.formats.text_table import head_lines
from ingest.session import CaptureSession
from omomo_core.errors import InputError

MIN_SECONDS = 1.0
MAX_SECONDS = 4 * 3600.0
MAX_METRES = 1e5
"""From the origin, along one axis; farther is another unit, or damage."""
_UNIT_TOLERANCE = 1e-3
_WILD = 9.0
"""No element of a rotation is near this size; squares of still larger ones might overflow."""
FINER = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
"""Seconds in the units that logs may count time in."""
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
    for unit, second in FINER.items():
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


T_ARKIT_ZUP = T_ZUP_ARKIT.T
"""Maps (x, y, z) to (x, z, -y): the z axis of a world that is z up becomes ARKit's y."""

_CAMERAS = {"arkit": np.eye(4), "opencv": T_OPENCV_ARKIT_CAMERA}
"""What turns the axes of a stated camera into ARKit's (multiplied from the right)."""
_WORLDS = {"y": np.eye(4), "z": T_ARKIT_ZUP}
"""What turns a world whose up axis is stated into ARKit's (multiplied from the left)."""

_LEFT_HANDED = re.compile(r"left[- ]?handed", re.I)
_STATED = re.compile(r"\s*#\s*(axes|up)\s*:\s*(.*?)\s*$")


def arkit_poses(
    T_zup_opencv: Float64[np.ndarray, "frames 4 4"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """T_world_phone from camera-to-world poses with OpenCV camera axes in a world that is z up."""
    return T_ARKIT_ZUP @ T_zup_opencv @ T_OPENCV_ARKIT_CAMERA


def opencv_poses(
    T_world_phone: Float64[np.ndarray, "frames 4 4"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses with ARKit's camera axes as poses with OpenCV's; inverse of `arkit_poses`."""
    return T_ZUP_ARKIT @ T_world_phone @ T_OPENCV_ARKIT_CAMERA


def session_of_poses(
    app: str,
    path: Path,
    log: Path,
    T_world_camera: Float64[np.ndarray, "frames 4 4"],
    times: Float64[np.ndarray, " frames"],
    usual: str,
    place: Place,
) -> CaptureSession:
    """The session of a log that holds camera poses alone, in axes that it may state in comments.

    Without a statement about `up` the world stays the log's own, because that is the world in which a user
    gives --up. Without one about `axes` the camera is read with the usual ones and left open.

    Args:
        app: name of the format.
        path: what the user gave.
        log: the file.
        T_world_camera: camera to world, metres.
        times: of the poses, seconds.
        usual: the camera's axes where the log states none, "arkit" or "opencv".
        place: file and line of a pose, for messages.

    Raises:
        InputError: "axes-unknown" for a comment that states other axes; and what every log is checked for.
    """
    stated = _stated_axes(log)
    T = _WORLDS[stated.get("up", "y")] @ T_world_camera @ _CAMERAS[stated.get("axes", usual)]
    check_poses(times, T, log, place)
    return CaptureSession(
        app=app,
        source=path,
        times=times,
        T_world_phone=T,
        gravity_aligned="up" in stated,
        world_axes=True,
        camera_open="axes" not in stated,
    )


def _stated_axes(log: Path) -> dict[str, str]:
    """The words of the comment lines `# axes: arkit` and `# up: y` at the top of a log, if there are any.

    Raises:
        InputError: "axes-unknown" for a comment that states other axes.
    """
    known = {"axes": tuple(_CAMERAS), "up": tuple(_WORLDS)}
    stated: dict[str, str] = {}
    for number, line in enumerate(head_lines(log), start=1):
        if line.lstrip().startswith("#") and _LEFT_HANDED.search(line):
            raise InputError(
                "axes-unknown",
                f"A comment says that the axes are left-handed: {line.strip()[:60]}",
                where=f"{log}:{number}",
                fix="Turn the trajectory into right-handed axes, and say so.",
            )
        if (match := _STATED.match(line)) is None:
            continue
        key, value = match[1], match[2].lower()
        if value not in known[key]:
            raise InputError(
                "axes-unknown",
                f"The comment states {key}: {value[:30]}; known are {' and '.join(known[key])}.",
                where=f"{log}:{number}",
                fix="Turn the trajectory into these axes, and state them.",
            )
        stated[key] = value
    return stated


def from_matrices(
    K: Float64[np.ndarray, "frames 3 3"], place: Place
) -> Float64[np.ndarray, "frames 4"]:
    """fx, fy, cx, cy of camera matrices given row by row, in their pixels.

    Raises:
        InputError: "camera-damaged" for a last row that is not 0 0 1 (a transposed matrix) or a
            focal length that is not positive.
    """
    bad = (np.abs(K[:, 2] - [0, 0, 1]) > 1e-3).any(axis=1) | (K[:, 0, 0] <= 0) | (K[:, 1, 1] <= 0)
    if bad.any():
        raise InputError(
            "camera-damaged",
            "The camera matrix is not fx 0 cx / 0 fy cy / 0 0 1 with positive focal lengths.",
            where=place(int(np.argmax(bad))),
            fix="Write it row by row, the principal point in the last column.",
        )
    return np.stack([K[:, 0, 0], K[:, 1, 1], K[:, 0, 2], K[:, 1, 2]], axis=1)


def to_matrix(intrinsics: Float64[np.ndarray, "4"]) -> list[list[float]]:
    """The rows of the camera matrix of fx, fy, cx, cy, for JSON."""
    fx, fy, cx, cy = intrinsics.tolist()
    return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def one_size(sizes: Float64[np.ndarray, "frames 2"], place: Place) -> tuple[int, int]:
    """Width and height, the same in every frame.

    Raises:
        InputError: "image-size" naming the first frame of another size.
    """
    changed = (sizes != sizes[0]).any(axis=1)
    if changed.any():
        row = int(np.argmax(changed))
        raise InputError(
            "image-size",
            f"The images change from {sizes[0, 0]:g} x {sizes[0, 1]:g} to "
            f"{sizes[row, 0]:g} x {sizes[row, 1]:g} pixels.",
            where=place(row),
            fix="Do not join logs: give one take as the app wrote it.",
        )
    return int(sizes[0, 0]), int(sizes[0, 1])


def at_times(
    times: Float64[np.ndarray, " frames"],
    known_times: Float64[np.ndarray, " known"],
    intrinsics: Float64[np.ndarray, "known 4"],
) -> Float64[np.ndarray, "frames 4"]:
    """Intrinsics of images, interpolated to the times of poses; the nearest beyond the ends."""
    columns = [np.interp(times, known_times, column) for column in intrinsics.T]
    return np.stack(columns, axis=1)
