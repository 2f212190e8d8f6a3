"""Spectacular AI: poses of the IMU by several methods, line by line, and the place of the camera."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ingest.formats import spectacular
from tests.ingest.formats.logs import MakeTake, error_of, write_log


def _write(folder: Path, *lines: dict[str, Any]) -> Path:
    camera = {"imuToCamera": [[1, 0, 0, 0.1], [0, 0, -1, 0.2], [0, 1, 0, 0.3], [0, 0, 0, 1]]}
    (folder / "calibration.json").write_text(json.dumps({"cameras": [camera]}))
    log = folder / "data.jsonl"
    log.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return log


def _pose(i: int) -> dict[str, Any]:
    position = {"x": i / 100, "y": 0, "z": 1}
    return {"position": position, "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}


def test_it_gives_the_camera_not_the_imu(tmp_path: Path):
    """The IMU lies level, 1 m up; the camera looks along its y and has it at (.1, .2, .3)."""
    sensor = {"sensor": {"type": "gyroscope", "values": [0, 0, 0]}, "time": -1}
    _write(tmp_path, sensor, *({"vio": _pose(i), "time": i / 10} for i in range(15)))
    session = spectacular.read(tmp_path)
    np.testing.assert_allclose(session.T_world_phone[0, :3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(session.T_world_phone[0, :3, 3], [-0.1, 1.2, 0.3])
    assert session.intrinsics is None
    assert session.video_times is None
    assert session.imu is None


def test_it_prefers_ground_truth_and_does_not_choose_among_methods(tmp_path: Path):
    both = [{"vio": _pose(3 * i), "slam": _pose(i), "time": i / 10} for i in range(15)]
    log = _write(tmp_path, *both)
    error = error_of(tmp_path)
    assert error.code == "poses-ambiguous"
    assert "vio, slam" in error.what
    _write(tmp_path, *(line | {"groundTruth": _pose(2 * i)} for i, line in enumerate(both)))
    assert spectacular.read(log).T_world_phone[10, 0, 3] == pytest.approx(0.2 - 0.1)


def test_it_needs_poses_and_the_place_of_the_camera(tmp_path: Path):
    log = _write(tmp_path, {"frames": [{"cameraInd": 0}], "number": 0, "time": 0.0})
    assert error_of(tmp_path).code == "poses-missing"
    _write(tmp_path, *({"groundTruth": _pose(i), "time": i / 10} for i in range(15)))
    (tmp_path / "calibration.json").unlink()
    assert error_of(log).code == "calibration-missing"


def test_it_names_the_line(take: MakeTake, tmp_path: Path):
    log = write_log(spectacular, take(0), tmp_path)
    lines = log.read_text().split("\n")
    cases = {
        "log-damaged": lines[20][:-9],
        "log-not-finite": lines[20].replace('"x": ', '"x": NaN, "was": ', 1),
        "log-key-missing": lines[20].replace('"w"', '"v"'),
        "pose-not-unit": lines[20].replace('"w": ', '"w": 3.0, "was": '),
    }
    for code, line in cases.items():
        log.write_text("\n".join([*lines[:20], line, *lines[21:]]))
        error = error_of(tmp_path)
        assert error.code == code
        assert "line 21" in error.where
    log.write_text("\n".join(lines[:60])[:-5])
    error = error_of(tmp_path)
    assert error.code == "log-truncated"
    assert "line 60" in error.where
