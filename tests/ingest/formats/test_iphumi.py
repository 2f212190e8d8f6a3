"""iPhUMI: times are ISO texts, one for each pose."""

from pathlib import Path
from typing import Any

import numpy as np

from ingest.formats import iphumi
from tests.ingest.formats.logs import MakeTake, edit_json, error_of, write_log


def test_times_are_iso_texts(take: MakeTake, tmp_path: Path):
    log = write_log(iphumi, take(0), tmp_path)
    start = 1726403696.789

    def stamp(recording: Any) -> None:
        count = len(recording["poseTimes"])
        recording["poseTimes"] = [
            f"2024-09-15T12:{34 + i // 60}:{i % 60:02d}.789Z" for i in range(count)
        ]
        recording["poseTimes"][0] = "2024-09-15T14:34:00.789+02:00"

    edit_json(log, stamp)
    times = iphumi.read(tmp_path).times
    np.testing.assert_allclose(times, start - 56 + np.arange(len(times)), atol=1e-6)
    edit_json(log, lambda recording: recording["poseTimes"].__setitem__(7, "noon"))
    error = error_of(tmp_path)
    assert error.code == "log-damaged"
    assert "'noon'" in error.what
    assert error.where == f"{log}, poseTimes[7]"


def test_it_needs_a_time_for_each_pose(take: MakeTake, tmp_path: Path):
    log = write_log(iphumi, take(0), tmp_path)
    edit_json(log, lambda recording: recording["poseTimes"].pop())
    error = error_of(tmp_path)
    assert error.code == "log-damaged"
    assert "poseTransforms" in error.where
