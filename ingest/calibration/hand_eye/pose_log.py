"""Poses of another tracker from a text file: t, x, y, z, qx, qy, qz, qw by commas or blanks."""

from pathlib import Path

import numpy as np

from ingest.calibration.hand_eye.streams import PoseStream
from ingest.formats.poses import poses_from_quaternions
from ingest.formats.table import numbers, read_rows
from omomo_core.errors import InputError

_COLUMNS = 8


def read_pose_log(path: Path) -> PoseStream:
    """Read a tracker's log (TUM text, or the same by commas); seconds, metres, quaternions xyzw.

    Lines of # are comments; of two poses with one stamp the first counts.

    Raises:
        InputError: "poses-missing", "poses-few", "poses-order", and those of
            `ingest.formats.table.numbers` and `ingest.formats.poses.poses_from_quaternions`.
    """
    if not path.is_file():
        raise InputError(
            "poses-missing", "There is no such file.", where=str(path), fix="Check the path."
        )
    rows = read_rows(path, None)
    if rows.rows and "," in "".join(rows.rows[0]):
        rows = read_rows(path, ",")
    table = numbers(rows, _COLUMNS, range(_COLUMNS))
    times = table.values[:, 0]
    if len(times) < 2:
        raise InputError("poses-few", "The file has no two poses.", where=str(path))
    back = np.flatnonzero(np.diff(times) < 0)
    if len(back):
        raise InputError(
            "poses-order",
            "The time runs backwards.",
            where=table.place(int(back[0]) + 1),
            fix="Sort the lines by their first number, in seconds.",
        )
    T = poses_from_quaternions(table.values[:, 1:4], table.values[:, 4:], table.place)
    new = np.concatenate([[True], np.diff(times) > 0])
    return PoseStream(times[new], T[new])
