"""ScanCapture: the state of the tracking in each line, and images of one size."""

from pathlib import Path

from ingest.formats import scan_capture
from tests.ingest.formats.logs import MakeTake, edit_line, edit_row, error_of, place, put, write_log


def test_states_are_normal_or_not(take: MakeTake, tmp_path: Path):
    log = write_log(scan_capture, take(0), tmp_path)
    for line, status in enumerate(scan_capture.STATUSES, start=2):
        edit_line(log, line, put(scan_capture, 1, f" {status}"))
    ok = scan_capture.read(tmp_path).tracking_ok
    assert ok is not None
    assert ok[:8].tolist() == [True, *[False] * 6, True]


def test_it_refuses_a_state_that_it_does_not_know(take: MakeTake, tmp_path: Path):
    log = write_log(scan_capture, take(0), tmp_path)
    edit_row(scan_capture, log, put(scan_capture, 1, " fine"))
    error = error_of(tmp_path)
    assert error.code == "tracking-unknown"
    assert error.where == place(scan_capture, log)
    assert "'fine'" in error.what
    assert "excessive motion" in error.what


def test_it_refuses_images_that_change_size(take: MakeTake, tmp_path: Path):
    log = write_log(scan_capture, take(0), tmp_path)
    edit_row(scan_capture, log, put(scan_capture, 9, " 1280"))
    error = error_of(tmp_path)
    assert (error.code, error.where) == ("image-size", place(scan_capture, log))
