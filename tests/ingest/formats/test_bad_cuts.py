"""A log that was cut short is an error, or its whole poses exactly; never another motion."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ingest.formats import spectacular
from ingest.formats.registry import Format, read_session
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from tests.ingest.formats.logs import (
    JSON,
    OBJECTS,
    TEXT,
    MakeTake,
    each,
    error_of,
    every_format,
    write_log,
)

LINES = (*TEXT, spectacular)


@each(*TEXT)
def test_cut_inside_the_last_line(take: MakeTake, tmp_path: Path, format_: Format):
    whole_take = take(0)
    for session in (whole_take, replace(whole_take, intrinsics=None, video_times=None)):
        log = write_log(format_, session, tmp_path)
        whole = log.read_text().rstrip()
        last_line = whole.count("\n") + 1
        for missing in (4, 5, 9, 40):
            log.write_text(whole[:-missing])
            error = error_of(tmp_path)
            assert error.code == "log-truncated"
            assert error.where == f"{log}:{last_line}"
            assert "copy the session" in error.fix
            assert f"delete line {last_line}" in error.fix


@each(*JSON)
def test_cut_before_the_end_of_the_object(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    log.write_text(log.read_text()[:-40])
    assert format_.detect(tmp_path)
    error = error_of(tmp_path)
    assert error.code == "log-truncated"
    assert str(log) in error.where


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_lines_cut_anywhere_are_an_error_or_exact(
    wander: Callable[..., CaptureSession], tmp_path: Path, data: st.DataObject
):
    """However many bytes arrive, no pose is silently wrong by more than the precision printed."""
    format_ = data.draw(st.sampled_from(LINES))
    session = replace(wander(5, seconds=1.4), imu=None)
    if data.draw(st.booleans()):
        session = replace(session, intrinsics=None)
    log = write_log(format_, session, tmp_path / format_.NAME)
    whole = log.read_bytes()
    log.write_bytes(whole[: data.draw(st.integers(1, len(whole)))])
    for read in (format_.read, read_session):
        try:
            back = read(log)
        except InputError:
            continue
        expected = session.T_world_phone[: len(back.times)]
        np.testing.assert_allclose(back.T_world_phone, expected, rtol=0, atol=4e-6)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_an_object_cut_anywhere_is_an_error(take: MakeTake, tmp_path: Path, data: st.DataObject):
    format_ = data.draw(st.sampled_from(OBJECTS))
    log = write_log(format_, take(5), tmp_path / format_.NAME)
    whole = log.read_bytes()
    log.write_bytes(whole[: data.draw(st.integers(1, len(whole) - 2))])
    assert error_of(log, format_.read).code == "log-truncated"


@every_format
def test_a_whole_last_line_without_its_end_is_fine(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    log.write_text(log.read_text().rstrip())
    assert len(read_session(log).times) == len(take(0).times)
