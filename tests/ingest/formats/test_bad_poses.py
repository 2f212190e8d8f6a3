"""Poses that are no rigid transforms, and a tracker that never started, are errors."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ingest.formats import (
    anysense,
    arkit_data_logger,
    arkit_recorder,
    ios_logger,
    iphumi,
    nerfcapture,
    nerfstudio,
    polycam,
    record3d,
    scan_capture,
    scanner_3d,
    scannetpp,
    stray_scanner,
    tum,
)
from ingest.formats.registry import Format
from tests.ingest.formats.logs import (
    ROW,
    MakeTake,
    each,
    edit_json,
    edit_row,
    error_of,
    every_format,
    place,
    put,
    write_log,
)
from tests.log_writers import write_session

LAST_OF_QUATERNION = {
    stray_scanner.NAME: 8,
    ios_logger.NAME: 7,
    scan_capture.NAME: 8,
    anysense.NAME: 4,
    tum.NAME: 7,
}


@each(stray_scanner, ios_logger, scan_capture, anysense, tum)
def test_quaternions_that_are_no_rotations(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    edit_row(format_, log, put(format_, LAST_OF_QUATERNION[format_.NAME], "1.4"))
    error = error_of(tmp_path)
    assert (error.code, error.where) == ("pose-not-unit", place(format_, log))


@pytest.mark.parametrize("number", ["1.5", "1e-320", "-1e300"])
def test_lines_of_matrices_that_are_no_rotations(take: MakeTake, tmp_path: Path, number: str):
    log = write_log(arkit_data_logger, take(0), tmp_path)
    edit_row(arkit_data_logger, log, put(arkit_data_logger, 1, number))
    error = error_of(tmp_path)
    assert (error.code, error.where) == ("pose-not-rigid", place(arkit_data_logger, log))


MATRIX = {
    scanner_3d.NAME: lambda values: (values, "cameraPoseARFrame"),
    nerfcapture.NAME: lambda values: (values["frames"][ROW], "transform_matrix"),
    nerfstudio.NAME: lambda values: (values["frames"][ROW], "transform_matrix"),
    arkit_recorder.NAME: lambda values: (values[sorted(values)[ROW]], "cameraTransform"),
    iphumi.NAME: lambda values: (values["poseTransforms"], ROW),
    scannetpp.NAME: lambda values: (values[sorted(values)[ROW]], "pose"),
}
"""The list or object that holds the matrix of pose ROW, and under which key."""
MATRICES = (scanner_3d, nerfcapture, nerfstudio, arkit_recorder, iphumi, scannetpp)


def _bend(format_: Format, log: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Change the matrix of pose ROW."""

    def bend(values: Any) -> None:
        if format_ is polycam:
            matrix = np.reshape([values[key] for key in polycam.MATRIX], (3, 4))
            values.update(zip(polycam.MATRIX, change(matrix).ravel().tolist(), strict=True))
            return
        holder, key = MATRIX[format_.NAME](values)
        matrix = change(np.reshape(holder[key], (4, 4)))
        holder[key] = matrix.reshape(np.shape(holder[key])).tolist()

    edit_json(log, bend)


@each(*MATRICES, polycam)
@pytest.mark.parametrize(
    ("factors", "fault"), [([1, 1, -1], "left-handed"), ([2, 2, 2], "no rotation")]
)
def test_left_handed_and_scaled_matrices(
    take: MakeTake, tmp_path: Path, format_: Format, factors: list[int], fault: str
):
    log = write_log(format_, take(0), tmp_path)
    _bend(format_, log, lambda matrix: matrix * [*factors, 1])
    error = error_of(tmp_path)
    assert error.code == "pose-not-rigid"
    assert fault in error.what
    assert error.where == place(format_, log)


@each(*MATRICES)
def test_transposed_matrices(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    _bend(format_, log, np.transpose)
    error = error_of(tmp_path)
    assert error.code == "pose-not-rigid"
    assert "transposed" in error.what
    assert error.where == place(format_, log)


@pytest.mark.parametrize(
    ("format_", "key"),
    [(arkit_recorder, "cameraIntrinsics"), (scannetpp, "intrinsic")],
    ids=[arkit_recorder.NAME, scannetpp.NAME],
)
def test_transposed_camera_matrices(take: MakeTake, tmp_path: Path, format_: Format, key: str):
    log = write_log(format_, take(0), tmp_path)

    def transpose(frames: Any) -> None:
        for frame in frames.values():
            frame[key] = np.transpose(frame[key]).tolist()

    edit_json(log, transpose)
    assert error_of(tmp_path).code == "camera-damaged"


@every_format
@pytest.mark.parametrize("pose", ["identity", "elsewhere"])
def test_tracking_never_started(take: MakeTake, tmp_path: Path, format_: Format, pose: str):
    session = take(0)
    one = np.eye(4) if pose == "identity" else session.T_world_phone[0]
    frozen = np.tile(one, (len(session.times), 1, 1))
    error = error_of(write_session(format_, replace(session, T_world_phone=frozen), tmp_path))
    if format_ is record3d:  # its world is the first frame's
        assert error.code == "front-camera"
        return
    assert error.code == "tracking-never-started"
    assert "tracking never started" in error.what
