"""read_session finds the session and its app, or says what it found instead."""

from pathlib import Path

import pytest

from ingest.formats import arkit_data_logger, ios_logger, stray_scanner
from ingest.formats.registry import FORMATS, read_session
from omomo_core.errors import InputError
from tests.log_writers import write_session

TEXT_FORMATS = (stray_scanner, ios_logger, arkit_data_logger)
TOLD_BY_CONTENT = (stray_scanner, arkit_data_logger)


@pytest.mark.parametrize("format_", FORMATS, ids=lambda f: f.NAME)
def test_a_folder_a_file_or_folders_around_it(wander, tmp_path: Path, format_):
    inner = write_session(
        format_, wander(0, seconds=1.2, rate=20), tmp_path / "share" / "outer" / "3f2a9c"
    )
    (tmp_path / "share" / "outer" / "__MACOSX").mkdir()
    (tmp_path / "share" / "outer" / "notes.txt").write_text("chair, take 2")
    write_session(format_, wander(1, seconds=1.2, rate=20), tmp_path / "share" / ".Trash" / "old")
    pose_files = [file for file in inner.rglob("*") if file.is_file() and format_.detect(file)]
    assert pose_files
    for path in (inner, inner.parent, inner.parent.parent, pose_files[0]):
        session = read_session(path)
        assert session.app == format_.NAME
        assert session.source == path
    assert _error(tmp_path).code == "session-unknown"


@pytest.mark.parametrize("format_", TOLD_BY_CONTENT, ids=lambda f: f.NAME)
def test_a_renamed_pose_file_is_known_by_its_content(wander, tmp_path: Path, format_):
    folder = write_session(format_, wander(0), tmp_path)
    log = max((p for p in folder.iterdir() if "imu" not in p.name), key=lambda p: p.stat().st_size)
    renamed = log.rename(tmp_path / "my take.log")
    assert read_session(renamed).app == format_.NAME


def _error(path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        read_session(path)
    return caught.value


def test_nothing_there(tmp_path: Path):
    assert _error(tmp_path / "nowhere").code == "session-missing"


def test_not_a_session_names_what_it_found_and_what_it_knows(tmp_path: Path):
    (tmp_path / "holiday.jpg").write_bytes(b"\xff\xd8")
    error = _error(tmp_path)
    assert error.code == "session-unknown"
    assert "holiday.jpg" in error.what
    assert "omocap formats" in error.fix
    assert ".zip" in error.fix
    assert "nearest" not in error.fix
    assert _error(tmp_path / "holiday.jpg").code == "session-unknown"


def test_not_a_session_names_the_format_that_is_nearest(tmp_path: Path):
    (tmp_path / "odometry_1.csv").write_text("nothing")
    error = _error(tmp_path)
    assert error.code == "session-unknown"
    assert error.fix.startswith(
        "The nearest is Stray Scanner, which is a folder with odometry.csv."
    )


def test_an_empty_folder_and_an_empty_file(tmp_path: Path):
    assert "empty" in _error(tmp_path).what
    (tmp_path / "nothing.bin").touch()
    assert _error(tmp_path / "nothing.bin").code == "session-unknown"


def test_two_sessions_are_not_chosen_between(wander, tmp_path: Path):
    stray_scanner.write(wander(0), tmp_path / "one")
    write_session(ios_logger, wander(1), tmp_path / "two")
    error = _error(tmp_path)
    assert error.code == "session-ambiguous"
    assert "one, two" in error.what


def test_two_sessions_at_different_depths(wander, tmp_path: Path):
    stray_scanner.write(wander(0), tmp_path / "one")
    write_session(ios_logger, wander(1), tmp_path / "shared" / "two")
    error = _error(tmp_path)
    assert error.code == "session-ambiguous"
    assert "one, shared/two" in error.what


def test_a_folder_of_a_thousand_folders_is_not_searched(wander, tmp_path: Path):
    stray_scanner.write(wander(0), tmp_path / "one")
    for k in range(1000):
        (tmp_path / str(k)).mkdir()
    error = _error(tmp_path)
    assert error.code == "session-unknown"
    assert "1000 folders" in error.what


def test_what_the_system_cannot_open_is_named(tmp_path: Path):
    error = _error(tmp_path / ("x" * 300))
    assert error.code == "session-unreadable"
    assert "too long" in error.what


def test_two_apps_in_one_folder(wander, tmp_path: Path):
    stray_scanner.write(wander(0), tmp_path)
    write_session(ios_logger, wander(1), tmp_path)
    assert _error(tmp_path).code == "session-ambiguous"


def test_two_trajectories_in_one_folder(wander, tmp_path: Path):
    write_session(arkit_data_logger, wander(0), tmp_path)
    text = (tmp_path / "ARKit_camera_pose.txt").read_text()
    (tmp_path / "ARKit_camera_pose_2.txt").write_text(text)
    error = _error(tmp_path)
    assert error.code == "session-ambiguous"
    assert "ARKit_camera_pose.txt, ARKit_camera_pose_2.txt" in error.what
    assert "instead of the folder" in error.fix
    assert read_session(tmp_path / "ARKit_camera_pose_2.txt").app == "ARKit Data Logger"
