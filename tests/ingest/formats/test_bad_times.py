"""A clock that does not advance, frames without a time, and logs too short are errors."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ingest.formats import (
    anysense,
    arkit_data_logger,
    arkit_recorder,
    arkitscenes,
    ios_logger,
    nerfcapture,
    nerfstudio,
    polycam,
    record3d,
    scan_capture,
    scanner_3d,
    scannetpp,
    tum,
)
from ingest.formats.registry import FORMATS, Format, read_session
from ingest.session import CaptureSession
from tests.ingest.formats.logs import (
    LAYOUT,
    ROW,
    MakeTake,
    each,
    edit_json,
    error_of,
    every_format,
    place,
    write_log,
)
from tests.log_writers import write_session

NAMED_BY_TIME = (polycam, arkit_recorder)
"""One name, one time: two poses of one time cannot be."""
IN_NO_ORDER = (*NAMED_BY_TIME, nerfcapture, nerfstudio)
"""Formats whose frames are put in order."""


@each(*(f for f in FORMATS if f not in IN_NO_ORDER))
def test_time_going_backwards(take: MakeTake, tmp_path: Path, format_: Format):
    session = take(0)
    times = session.times.copy()
    times[ROW:] -= 0.5
    log = write_log(format_, replace(session, times=times), tmp_path)
    error = error_of(tmp_path)
    assert error.code == "time-backwards"
    assert error.where == place(format_, log)


@each(*(f for f in FORMATS if f not in NAMED_BY_TIME))
def test_of_poses_with_one_stamp_the_first_counts(take: MakeTake, tmp_path: Path, format_: Format):
    """Loggers double a line, and stamps rounded to 10 ms meet."""
    session = take(0)
    times = session.times.copy()
    times[ROW] = times[ROW - 1]
    times[ROW + 6] = times[ROW + 5]
    write_log(format_, replace(session, times=times), tmp_path)
    back = read_session(tmp_path)
    kept = np.delete(np.arange(len(times)), [ROW, ROW + 6])
    assert len(back.times) == len(kept)
    assert (np.diff(back.times) > 0).all()
    for part in (back.intrinsics, back.tracking_ok):
        assert part is None or len(part) == len(kept)
    assert any(note.startswith("2 poses have the stamps") for note in back.notes)


@each(scanner_3d, nerfcapture, nerfstudio)
def test_a_frame_without_its_time(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    key = "time" if format_ is scanner_3d else "timestamp"
    edit_json(log, lambda values: values.get("frames", {ROW: values})[ROW].pop(key))
    error = error_of(tmp_path)
    assert error.code == "log-key-missing"
    assert f'"{key}"' in error.what
    assert error.where == place(format_, log)


@every_format
def test_less_than_a_second(wander: Callable[..., CaptureSession], tmp_path: Path, format_: Format):
    error = error_of(write_session(format_, wander(0, seconds=0.8), tmp_path))
    assert error.code == "log-short"
    assert "0.80 s" in error.what


NOTHING = [
    (f, "") for f in (ios_logger, arkit_data_logger, scan_capture, anysense, tum, arkitscenes)
]
NOTHING += [(f, "{}") for f in (arkit_recorder, scannetpp)]
NOTHING += [
    (record3d, '{"poses": [], "initPose": [], "fps": 30}'),
    (nerfcapture, '{"frames": []}'),
    (nerfstudio, '{"fps": 30, "frames": []}'),
]


@pytest.mark.parametrize(("format_", "text"), NOTHING, ids=[f.NAME for f, _ in NOTHING])
def test_no_poses_at_all(tmp_path: Path, format_: Format, text: str):
    log = tmp_path / LAYOUT[format_.NAME].files
    log.write_text(text)
    assert error_of(log, format_.read).code == "log-short"
