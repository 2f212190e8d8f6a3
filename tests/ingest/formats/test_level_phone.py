"""A phone held level, as each app writes it: worlds y or z up, cameras of ARKit or of OpenCV."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from ingest.formats import anysense, arkitscenes, scan_capture, scannetpp, tum
from ingest.formats.registry import Format
from ingest.session import CaptureSession
from tests.ingest.formats.logs import MakeTake, each, separator, write_log

S = np.sqrt(0.5)
LEVEL = {
    scan_capture.NAME: [1, 2, 3, 0, 0, 0, 1],
    anysense.NAME: [0, 0, 0, 1, 1, 2, 3],
    tum.NAME: [1, -3, 2, -S, 0, 0, S],
    arkitscenes.NAME: [np.pi / 2, 0, 0, -1, 2, 3],
}
"""The pose of a phone held level in landscape at (1, 2, 3), looking at the horizon along -z.

In a world that is z up it stands at (1, -3, 2) and looks along +y. OpenCV's camera there is a
quarter turn about x, and from it the origin lies 1 to the left, 2 below and 3 ahead.
"""


def _level(session: CaptureSession) -> CaptureSession:
    T = np.tile(np.eye(4), (len(session.times), 1, 1))
    T[:, :3, 3] = [1, 2, 3]
    T[1:, 0, 3] += 0.01 * np.arange(len(T) - 1)
    return replace(session, T_world_phone=T)


@each(scan_capture, anysense, tum, arkitscenes)
def test_in_text_logs(take: MakeTake, tmp_path: Path, format_: Format):
    session = _level(take(0))
    log = write_log(format_, session, tmp_path)
    row = next(line for line in log.read_text().split("\n") if not line.startswith("#"))
    first = 2 if format_ is scan_capture else 1
    fields = row.split(separator(format_))[first:]
    level = LEVEL[format_.NAME]
    numbers = [float(field) for field in fields[: len(level)]]
    np.testing.assert_allclose(numbers, level, atol=1e-8)
    back = format_.read(tmp_path)
    np.testing.assert_allclose(back.T_world_phone[0], session.T_world_phone[0], atol=1e-8)


def test_in_scannetpp_the_aligned_pose_is_opencv_and_z_up(take: MakeTake, tmp_path: Path):
    session = _level(take(0))
    log = write_log(scannetpp, session, tmp_path)
    frame = json.loads(log.read_text())["frame_000000"]
    assert frame["pose"] == session.T_world_phone[0].tolist()
    level = [[1, 0, 0, 1], [0, 0, 1, -3], [0, -1, 0, 2], [0, 0, 0, 1]]
    np.testing.assert_allclose(frame["aligned_pose"], level)
