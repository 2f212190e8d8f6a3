"""Checks and conversions every pose log needs, each failure naming the line."""

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.formats.table import Table
from omomo_core.errors import InputError

MIN_SECONDS = 1.0
_UNIT_TOLERANCE = 1e-3
_FIX_LOG = "Give the log as the app wrote it; if it is untouched, record the take again."


def poses_from_quaternions(
    table: Table, xyz: slice, xyzw: tuple[int, int, int, int]
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses from position columns and quaternion columns (given in the order x, y, z, w)."""
    quaternions = table.values[:, list(xyzw)]
    off = np.abs(np.linalg.norm(quaternions, axis=1) - 1)
    if (off > _UNIT_TOLERANCE).any():
        row = int(np.argmax(off > _UNIT_TOLERANCE))
        raise InputError(
            "pose-not-unit",
            f"The quaternion has length {np.linalg.norm(quaternions[row]):.4f} instead of 1.",
            where=table.place(row),
            fix=_FIX_LOG,
        )
    return _poses(Rotation.from_quat(quaternions).as_matrix(), table.values[:, xyz])


def poses_from_matrices(
    table: Table, rows_3x4: Float64[np.ndarray, "frames 3 4"]
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses from [R | t]; R is made exactly orthonormal (logs print six decimals)."""
    R = rows_3x4[:, :, :3]
    off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    off = np.maximum(off, np.abs(np.linalg.det(R) - 1))
    if (off > _UNIT_TOLERANCE).any():
        row = int(np.argmax(off > _UNIT_TOLERANCE))
        raise InputError(
            "pose-not-rigid",
            f"The 3x3 part is no rotation: it is off by {off[row]:.2g}.",
            where=table.place(row),
            fix=_FIX_LOG,
        )
    return _poses(Rotation.from_matrix(R).as_matrix(), rows_3x4[:, :, 3])


def _poses(
    R: Float64[np.ndarray, "frames 3 3"], t: Float64[np.ndarray, "frames 3"]
) -> Float64[np.ndarray, "frames 4 4"]:
    T = np.tile(np.eye(4), (len(R), 1, 1))
    T[:, :3, :3] = R
    T[:, :3, 3] = t
    return T


def check_length(table: Table) -> None:
    """Refuse a log of fewer than two rows or less than a second (column 0 is the time)."""
    if len(table.lines) >= 2 and table.values[-1, 0] - table.values[0, 0] >= MIN_SECONDS:
        return
    seconds = float(np.ptp(table.values[:, 0])) if len(table.lines) else 0.0
    last = f":{table.lines[-1]}" if table.lines else ""
    raise InputError(
        "log-short",
        f"{table.path.name} holds {len(table.lines)} poses over {seconds:.2f} s; "
        f"a take needs at least {MIN_SECONDS:g} s.",
        where=f"{table.path}{last}",
        fix="Record a longer take, or copy the session again if it was longer than this.",
    )


def check_poses(table: Table, T_world_phone: Float64[np.ndarray, "frames 4 4"]) -> None:
    """Refuse time that does not advance, logs too short, and a tracker that never started.

    Column 0 of the table is the time in seconds.
    """
    steps = np.diff(table.values[:, 0])
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0))
        raise InputError(
            "time-backwards",
            "The clock does not advance: it goes from "
            f"{table.values[row, 0]:.6f} s to {table.values[row + 1, 0]:.6f} s.",
            where=table.place(row + 1),
            fix="Do not join or re-order logs: give one take as the app wrote it.",
        )
    check_length(table)
    if np.ptp(T_world_phone, axis=0).max() < 1e-6:
        at_origin = np.allclose(T_world_phone[0, :3, 3], 0)
        raise InputError(
            "tracking-never-started",
            f"All {len(T_world_phone)} poses are the same{' (the origin)' if at_origin else ''}: "
            "tracking never started.",
            where=str(table.path),
            fix="Use the back camera in a lit, textured room, move the phone until the app shows "
            "tracking, then record again.",
        )
