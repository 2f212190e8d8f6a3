"""NeRFCapture: frames lie in the order in which they were written out."""

from pathlib import Path

import numpy as np

from ingest.formats import nerfcapture
from tests.ingest.formats.logs import MakeTake, edit_json
from tests.log_writers import write_session


def test_frames_are_put_in_order(take: MakeTake, tmp_path: Path):
    session = take(0)
    log = write_session(nerfcapture, session, tmp_path) / "transforms.json"
    edit_json(log, lambda values: np.random.default_rng(0).shuffle(values["frames"]))
    back = nerfcapture.read(tmp_path)
    np.testing.assert_array_equal(back.times, session.times)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, atol=1e-12)
    np.testing.assert_array_equal(back.intrinsics, session.intrinsics)
