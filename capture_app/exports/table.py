"""CSV: one row a frame, for spreadsheets and statistics."""

import csv
from pathlib import Path

import numpy as np
from jaxtyping import Float

from capture_app.commands.export import Units
from capture_app.exports.take import Take
from capture_app.quaternions import xyzw_from_matrix

_CONTACTS = (
    "left_hand_contact", "right_hand_contact", "left_ankle_contact", "right_ankle_contact",
    "left_toe_contact", "right_toe_contact",
)  # fmt: skip


def write_table(path: Path, take: Take, units: Units) -> None:
    """Write a table with one header row that names every column and its unit.

    `frame`, `time_s`; `JOINT_x_m`, `_y_m`, `_z_m` of every joint in the world (`_cm` in
    centimetres); `object_x_m` ... of the mesh's origin and `object_qx`, `_qy`, `_qz`, `_qw`, its
    R_world_object; the contacts, 1 or 0.

    Args:
        path: the .csv file to write.
        take: in the axes and units of the file.
        units: the take's.
    """
    T = take.T_world_object
    frames = len(T)
    values = [
        take.times[:, None],
        take.positions.reshape(frames, -1),
        T[:, :3, 3],
        xyzw_from_matrix(T[:, :3, :3]),
    ]
    contacts = np.concatenate([take.hand_contact, take.foot_contact], axis=1).astype(int)
    rows = zip(np.concatenate(values, axis=1), contacts.tolist(), strict=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(_header(take, units))
        writer.writerows([k, *_rounded(row), *touch] for k, (row, touch) in enumerate(rows))


def _header(take: Take, units: Units) -> list[str]:
    points = [f"{n}_{axis}_{units}" for n in (*take.skeleton.names, "object") for axis in "xyz"]
    return ["frame", "time_s", *points, *(f"object_q{k}" for k in "xyzw"), *_CONTACTS]


def _rounded(row: Float[np.ndarray, " columns"]) -> list[str]:
    return [f"{x:.6f}" for x in row]
