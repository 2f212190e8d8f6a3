"""ARKitRecorder: what the app writes beyond what our writer does."""

import json
from pathlib import Path

import numpy as np

from ingest.formats import arkit_recorder


def test_as_the_app_writes_it(tmp_path: Path):
    """Frames in no order, single precision, other keys, and images for some of them."""
    frames = {
        f"{41005.0 + i / 10:.6f}.jpg": {
            "cameraPos": {"y": 2, "x": 1 + i / 100, "z": 3},
            "cameraTransform": [[1, 0, 0, 1 + i / 100], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 0.9999999]],
            "cameraIntrinsics": [[1089.032, 0, 639.5], [0, 1089.032, 359.5], [0, 0, 1]],
            "lightEstimate": 900,
            "imageResolution": {"height": 720, "width": 1280},
            "ARPointCloud": {"count": 1, "points": [[0.009132311, -0.1209963, -0.3236341]]},
            "timeStamp": 41005.0 + i / 10,
        }
        for i in reversed(range(15))
    }  # fmt: skip
    (tmp_path / "3-20-23-27.json").write_text(json.dumps(frames))
    (tmp_path / "41005.300000.jpg").write_bytes(b"\xff\xd8")
    session = arkit_recorder.read(tmp_path)
    np.testing.assert_allclose(session.times, 41005.0 + np.arange(15) / 10)
    np.testing.assert_allclose(session.T_world_phone[4, :3, 3], [1.04, 2, 3])
    assert session.intrinsics is not None
    assert session.intrinsics[2].tolist() == [1089.032, 1089.032, 639.5, 359.5]
    assert session.image_size == (1280, 720)
    assert session.images == (tmp_path / "41005.300000.jpg",)
    assert session.video_times is not None
    assert session.video_times.tolist() == [41005.3]
