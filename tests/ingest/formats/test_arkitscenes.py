"""ARKitScenes: a file of the camera for each of its times."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ingest.formats import arkitscenes
from ingest.session import CaptureSession
from tests.ingest.formats.logs import error_of, write_log


def test_intrinsics_belong_to_their_times(wander: Callable[..., CaptureSession], tmp_path: Path):
    log = write_log(arkitscenes, replace(wander(0), intrinsics=None), tmp_path)
    start = arkitscenes.read(log).times[0]
    (tmp_path / "lowres_wide_intrinsics").mkdir()
    for seconds, f in ((0, 210), (2, 220)):
        name = f"42444949_{start + seconds:.3f}.pincam"
        (tmp_path / "lowres_wide_intrinsics" / name).write_text(f"256 192 {f} {f} 127.5 95.5")
    back = arkitscenes.read(tmp_path)
    assert back.image_size == (256, 192)
    assert back.intrinsics is not None
    np.testing.assert_allclose(back.intrinsics[60], [215, 215, 127.5, 95.5], atol=1e-6)
    (tmp_path / "lowres_wide_intrinsics" / "notes.pincam").write_text("256 192 1 1 1 1")
    error = error_of(tmp_path)
    assert error.code == "log-damaged"
    assert "notes.pincam" in error.where
