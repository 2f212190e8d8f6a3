"""Numbers that are finite but no motion of a phone are refused where they stand."""

from dataclasses import replace
from pathlib import Path

import pytest

from ingest.formats import arkit_data_logger, ios_logger, stray_scanner
from ingest.formats.registry import read_session
from omomo_core.errors import InputError
from tests.log_writers import write_session

every_format = pytest.mark.parametrize(
    "format_", [stray_scanner, ios_logger, arkit_data_logger], ids=lambda f: f.NAME
)


@every_format
@pytest.mark.parametrize("metres", [2e5, -1e30])
def test_positions_beyond_any_walk(wander, tmp_path: Path, format_, metres: float):
    session = wander(0)
    T = session.T_world_phone.copy()
    T[40, 1, 3] = metres
    write_session(format_, replace(session, T_world_phone=T), tmp_path)
    with pytest.raises(InputError) as caught:
        read_session(tmp_path)
    assert caught.value.code == "pose-far"
    assert int(caught.value.where.rsplit(":", 1)[1]) in (41, 42)


@every_format
def test_takes_of_days(wander, tmp_path: Path, format_):
    session = wander(0)
    times = session.times.copy()
    times[50:] += 90_000
    write_session(format_, replace(session, times=times), tmp_path)
    with pytest.raises(InputError) as caught:
        read_session(tmp_path)
    assert caught.value.code == "log-long"
    assert int(caught.value.where.rsplit(":", 1)[1]) in (51, 52)
