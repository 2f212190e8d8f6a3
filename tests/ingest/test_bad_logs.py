"""A defective log is an error that names file and line and says what to do; never a short motion."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ingest.formats import arkit_data_logger, ios_logger, stray_scanner
from ingest.formats.detect import FORMATS, read_session
from omomo_core.errors import InputError

POSE_FILE = {
    "Stray Scanner": "odometry.csv",
    "ios_logger": "ARposes.txt",
    "ARKit Data Logger": "ARKit_camera_pose.txt",
}
every_format = pytest.mark.parametrize("format_", FORMATS, ids=lambda f: f.NAME)


def _error(path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        read_session(path)
    return caught.value


def _edit(path: Path, line: int, change) -> None:
    lines = path.read_text().split("\n")
    lines[line - 1] = change(lines[line - 1])
    path.write_text("\n".join(lines))


def _log(format_, session, folder: Path) -> Path:
    return format_.write(session, folder) / POSE_FILE[format_.NAME]


@every_format
def test_cut_inside_the_last_line(wander, tmp_path: Path, format_):
    log = _log(format_, replace(wander(0), intrinsics=None, video_times=None), tmp_path)
    whole = log.read_text().rstrip()
    last_line = whole.count("\n") + 1
    for missing in (4, 9, 40):
        log.write_text(whole[:-missing])
        error = _error(tmp_path)
        assert error.code == "log-truncated"
        assert error.where == f"{log}:{last_line}"
        assert "copy the session" in error.fix
        assert f"delete line {last_line}" in error.fix


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_cut_anywhere_is_an_error_or_exact(wander, tmp_path: Path, data):
    """However many bytes arrive, no pose is silently wrong by more than the precision printed."""
    format_ = data.draw(st.sampled_from(FORMATS))
    session = replace(wander(5, seconds=1.4), imu=None)
    log = _log(format_, session, tmp_path / format_.NAME)
    whole = log.read_bytes()
    log.write_bytes(whole[: data.draw(st.integers(1, len(whole)))])
    try:
        back = read_session(log)
    except InputError:
        return
    finally:
        log.write_bytes(whole)
    expected = session.T_world_phone[: len(back.times)]
    np.testing.assert_allclose(back.T_world_phone, expected, rtol=0, atol=4e-6)


def test_a_whole_last_line_without_its_end_is_fine(wander, tmp_path: Path):
    for format_ in FORMATS:
        log = _log(format_, replace(wander(0), intrinsics=None), tmp_path / format_.NAME)
        count = len(read_session(log).times)
        log.write_text(log.read_text().rstrip())
        assert len(read_session(log).times) == count


@every_format
@pytest.mark.parametrize("bad", ["nan", "inf"])
def test_not_finite(wander, tmp_path: Path, format_, bad):
    log = _log(format_, wander(0), tmp_path)
    separator = " " if format_ is arkit_data_logger else ","
    column = 4 if format_ is arkit_data_logger else 2

    def put(line: str) -> str:
        fields = line.split(separator)
        fields[column] = bad
        return separator.join(fields)

    _edit(log, 30, put)
    error = _error(tmp_path)
    assert error.code == "log-not-finite"
    assert error.where.endswith(":30")


@every_format
def test_a_damaged_line_in_the_middle(wander, tmp_path: Path, format_):
    log = _log(format_, wander(0), tmp_path)
    _edit(log, 20, lambda line: line[:25])
    error = _error(tmp_path)
    assert error.code == "log-damaged"
    assert error.where == f"{log}:20"
    _edit(log, 20, lambda _: "\x00garbage\x00")
    assert _error(tmp_path).where == f"{log}:20"


@every_format
def test_time_going_backwards(wander, tmp_path: Path, format_):
    session = wander(0)
    times = session.times.copy()
    times[50:] -= 0.5
    _log(format_, replace(session, times=times), tmp_path)
    error = _error(tmp_path)
    assert error.code == "time-backwards"
    assert int(error.where.rsplit(":", 1)[1]) in (51, 52)


@every_format
def test_less_than_a_second(wander, tmp_path: Path, format_):
    _log(format_, wander(0, seconds=0.8), tmp_path)
    error = _error(tmp_path)
    assert error.code == "log-short"
    assert "0.80 s" in error.what


@every_format
@pytest.mark.parametrize("pose", ["identity", "elsewhere"])
def test_tracking_never_started(wander, tmp_path: Path, format_, pose):
    session = wander(0)
    one = np.eye(4) if pose == "identity" else session.T_world_phone[0]
    frozen = np.tile(one, (len(session.times), 1, 1))
    _log(format_, replace(session, T_world_phone=frozen), tmp_path)
    error = _error(tmp_path)
    assert error.code == "tracking-never-started"
    assert "tracking never started" in error.what


def test_quaternions_that_are_no_rotations(wander, tmp_path: Path):
    log = _log(ios_logger, wander(0), tmp_path)
    _edit(log, 7, lambda line: ",".join([*line.split(",")[:4], "0.5", "0.5", "0.5", "0.6"]))
    error = _error(tmp_path)
    assert error.code == "pose-not-unit"
    assert error.where == f"{log}:7"


def test_matrices_that_are_no_rotations(wander, tmp_path: Path):
    log = _log(arkit_data_logger, wander(0), tmp_path)
    _edit(log, 7, lambda line: line.replace(line.split()[1], "1.5", 1))
    error = _error(tmp_path)
    assert error.code == "pose-not-rigid"
    assert error.where == f"{log}:7"


def test_missing_columns_and_empty_files(wander, tmp_path: Path):
    log = _log(stray_scanner, wander(0), tmp_path / "stray")
    _edit(log, 1, lambda header: header.replace("qw", "w"))
    error = _error(tmp_path / "stray")
    assert error.code == "log-columns"
    assert "qw" in error.what
    log.write_text("")
    assert _error(tmp_path / "stray").code == "log-columns"
    for format_ in (ios_logger, arkit_data_logger):
        log = _log(format_, wander(0), tmp_path / format_.NAME)
        log.write_text("")
        assert _error(tmp_path / format_.NAME).code == "log-short"


def test_a_cut_imu_file_is_named(wander, tmp_path: Path):
    stray_scanner.write(wander(0), tmp_path)
    imu = tmp_path / "imu.csv"
    imu.write_text(imu.read_text()[:-30])
    error = _error(tmp_path)
    assert error.code == "log-truncated"
    assert "imu.csv:" in error.where
