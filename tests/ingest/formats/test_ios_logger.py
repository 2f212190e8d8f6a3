"""ios_logger: the camera is logged with the images, which are fewer than the poses."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ingest.formats import ios_logger
from ingest.formats.registry import read_session
from tests.ingest.formats.logs import MakeTake
from tests.log_writers import write_session


def test_the_camera_between_images_is_interpolated(take: MakeTake, tmp_path: Path):
    session = take(0)
    images = session.times[::2]
    assert session.intrinsics is not None
    between = np.stack(
        [np.interp(session.times, images, k) for k in session.intrinsics[::2].T], axis=1
    )
    session = replace(session, video_times=images, intrinsics=between)
    back = read_session(write_session(ios_logger, session, tmp_path))
    np.testing.assert_allclose(back.intrinsics, between, rtol=0, atol=1e-3)
    np.testing.assert_allclose(back.video_times, images, rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=1e-6)
