"""A number that is none, or a line that is damaged, is an error that says where."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ingest.formats.registry import Format
from tests.ingest.formats.logs import (
    JSON,
    OBJECTS,
    ROW,
    TEXT,
    MakeTake,
    each,
    edit_row,
    error_of,
    place,
    write_log,
)

MARK = 3.0625
"""Metres that no number of a log but the position of pose ROW has, and every format prints."""
NOT_FINITE = [(f, bad) for f in TEXT for bad in ("nan", "inf", "-inf")]
NOT_FINITE += [(f, bad) for f in JSON for bad in ("NaN", "Infinity", "-Infinity")]


@pytest.mark.parametrize(
    ("format_", "bad"), NOT_FINITE, ids=[f"{f.NAME}-{bad}" for f, bad in NOT_FINITE]
)
def test_not_finite(take: MakeTake, tmp_path: Path, format_: Format, bad: str):
    T = np.tile(np.eye(4), (len(take(0).times), 1, 1))
    T[:, :3, 3] = np.arange(len(T))[:, None] / 100
    T[ROW, :3, 3] = MARK
    log = write_log(format_, replace(take(0), T_world_phone=T), tmp_path)
    text, count = re.subn(rf"-?{re.escape(str(MARK))}0*", bad, log.read_text(), count=1)
    assert count == 1
    log.write_text(text)
    error = error_of(tmp_path)
    assert error.code == "log-not-finite"
    assert error.where.startswith(str(log) if format_ in OBJECTS else place(format_, log))
    assert error.fix


@each(*TEXT)
def test_a_damaged_line_in_the_middle(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    edit_row(format_, log, lambda line: line[:25])
    error = error_of(tmp_path)
    assert error.code == "log-damaged"
    assert error.where == place(format_, log)
    edit_row(format_, log, lambda _: "\x00garbage\x00")
    assert error_of(tmp_path).where == place(format_, log)
