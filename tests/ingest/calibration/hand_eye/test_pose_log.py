"""Logs of other trackers: commas or blanks, and what is wrong with them named by line."""

from pathlib import Path

import numpy as np
import pytest

from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.calibration.hand_eye.to_mount import read_pose_log, refuse_other_lengths
from omomo_core.errors import InputError

GOOD = ["0.0 1 2 3 0 0 0 1", "0.1 1 2 3.5 0 0 1 0", "0.1 9 9 9 0 0 0 1", "0.2 1 2 4 1 0 0 0"]


def _write(tmp_path: Path, lines: list[str]) -> Path:
    path = tmp_path / "log.txt"
    path.write_text("\n".join(["# t x y z qx qy qz qw", *lines]) + "\n")
    return path


@pytest.mark.parametrize("separator", [" ", ",", ", "])
def test_commas_or_blanks_and_the_first_of_two_stamps(tmp_path: Path, separator: str):
    stream = read_pose_log(_write(tmp_path, [line.replace(" ", separator) for line in GOOD]))
    np.testing.assert_array_equal(stream.times, [0, 0.1, 0.2])
    np.testing.assert_array_equal(stream.T[:, :3, 3], [[1, 2, 3], [1, 2, 3.5], [1, 2, 4]])
    np.testing.assert_allclose(stream.T[1, :3, :3], np.diag([-1, -1, 1]), atol=1e-15)


@pytest.mark.parametrize(
    ("lines", "code", "line"),
    [
        (GOOD[:1], "poses-few", ""),
        ([GOOD[3], GOOD[0]], "poses-order", ":3"),
        ([GOOD[0], "0.1 1 2 3 0 0 0 2"], "pose-not-unit", ":3"),
        ([GOOD[0], "0.1 1 2 3 0 0 0", GOOD[3]], "log-damaged", ":3"),
        ([GOOD[0], "0.1 1 2 nan 0 0 0 1"], "log-not-finite", ":3"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, lines: list[str], code: str, line: str):
    with pytest.raises(InputError) as caught:
        read_pose_log(_write(tmp_path, lines))
    assert caught.value.code == code
    assert line in caught.value.where


def test_no_file(tmp_path: Path):
    with pytest.raises(InputError) as caught:
        read_pose_log(tmp_path / "none.txt")
    assert caught.value.code == "poses-missing"


TIMES = np.arange(300) / 60


def _moving(metres: float) -> PoseStream:
    """A thing that turns by up to 60 degrees and moves by 30 cm, logged in some unit."""
    T = np.tile(np.eye(4), (len(TIMES), 1, 1))
    angle = np.sin(2 * TIMES)
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0] = np.sin(angle)
    T[:, 0, 1] = -T[:, 1, 0]
    T[:, 0, 3] = 0.3 * metres * np.sin(3 * TIMES)
    return PoseStream(TIMES, T)


@pytest.mark.parametrize(("unit", "name"), [(1000, "millimetres"), (100, "centimetres")])
def test_positions_in_another_unit_are_named(tmp_path: Path, unit: float, name: str):
    refuse_other_lengths(_moving(1), _moving(1), tmp_path)
    with pytest.raises(InputError) as caught:
        refuse_other_lengths(_moving(1), _moving(unit), tmp_path)
    assert caught.value.code == "units-length"
    assert name in caught.value.what


@pytest.mark.parametrize(("header", "row"), [
    ("", "{ns} {x} 2 3 0 0 0 1"),
    ("", "{ms} {x} 2 3 0 0 0 1"),
    ("timestamp [us],tx [mm],ty [mm],tz [mm],qw,qx,qy,qz", "{us},{mm},2000,3000,1,0,0,0"),
    ("Time (s);X;Y;Z;QX;QY;QZ;QW", "{t};{x};2;3;0;0;0;1"),
])  # fmt: skip
def test_a_tracker_states_its_columns_and_units(tmp_path: Path, header: str, row: str):
    """A clock in nanoseconds once asked for 18 TiB of samples."""
    lines = [row.format(t=f"{t:.6f}", ms=1e3 * t, us=round(1e6 * t), ns=round(1e9 * t) + 10**18,
                        x=1 + t, mm=1000 * (1 + t)) for t in TIMES]  # fmt: skip
    log = tmp_path / "log.csv"
    log.write_text("\n".join([*([header] if header else []), *lines, ""]))
    stream = read_pose_log(log)
    np.testing.assert_allclose(stream.times - stream.times[0], TIMES, atol=1e-5)
    np.testing.assert_allclose(
        stream.T[:, :3, 3], np.stack([1 + TIMES, 0 * TIMES + 2, 0 * TIMES + 3], 1)
    )
    np.testing.assert_allclose(stream.T[:, :3, :3], np.tile(np.eye(3), (300, 1, 1)))


def test_days_of_a_log_are_no_defect(tmp_path: Path):
    log = _write(tmp_path, [GOOD[0], "1e15 1 2 3 0 0 0 1"])
    with pytest.raises(InputError) as caught:
        read_pose_log(log)
    assert caught.value.code == "log-long"
