"""Logs of other trackers: commas or blanks, and what is wrong with them named by line."""

from pathlib import Path

import numpy as np
import pytest

from ingest.calibration.hand_eye.to_mount import read_pose_log
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
