"""Every format reads back what it writes, to the precision it prints."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.formats import (
    anysense,
    arkit_data_logger,
    arkit_recorder,
    arkitscenes,
    ios_logger,
    iphumi,
    nerfcapture,
    nerfstudio,
    polycam,
    pose_table,
    record3d,
    scan_capture,
    scanner_3d,
    scannetpp,
    spectacular,
    stray_scanner,
    tum,
)
from ingest.formats.registry import Format, read_session
from ingest.session import CaptureSession
from omomo_core.geometry.transforms import inverse
from tests.ingest.formats.logs import MakeTake, every_format, seeds
from tests.log_writers import write_session


class Kept(NamedTuple):
    """How far what comes back may be from what was written; None where the format has none."""

    times: float
    poses: float
    camera: float | None
    """Relative to the number."""
    imu: float | None = None
    video_times: bool = False
    rate: float = 30.0
    """Poses a second of the take."""


MILLISECONDS = 0.000501
KEPT = {
    stray_scanner.NAME: Kept(0, 6e-7, 1e-7, imu=1e-12, video_times=True),
    ios_logger.NAME: Kept(1e-6, 4e-6, 1e-6, imu=1e-5, video_times=True),
    arkit_data_logger.NAME: Kept(1e-9, 2e-6, None),
    scan_capture.NAME: Kept(1e-6, 1e-8, 1e-11),
    anysense.NAME: Kept(MILLISECONDS, 1e-8, None),
    pose_table.NAME: Kept(1e-8, 1e-8, None),
    tum.NAME: Kept(1e-8, 1e-8, None),
    # Its camera files are named to the millisecond.
    arkitscenes.NAME: Kept(1e-8, 1e-8, 1e-9, rate=10.0),
    record3d.NAME: Kept(6e-7, 1e-12, 1e-12),
    polycam.NAME: Kept(6e-7, 1e-12, 1e-12),
    scanner_3d.NAME: Kept(6e-7, 1e-12, 1e-12),
    nerfcapture.NAME: Kept(6e-7, 1e-12, 1e-12),
    nerfstudio.NAME: Kept(6e-7, 1e-12, 1e-12),
    arkit_recorder.NAME: Kept(1e-9, 1e-12, 1e-12),
    iphumi.NAME: Kept(MILLISECONDS, 1e-12, 1e-12, video_times=True),
    scannetpp.NAME: Kept(1e-9, 1e-12, 1e-12),
    spectacular.NAME: Kept(1e-9, 1e-12, 1e-12, video_times=True),
}


def _as_kept(format_: Format, session: CaptureSession) -> CaptureSession:
    """Record3D starts its own world; iPhUMI has one camera matrix."""
    assert session.intrinsics is not None
    if format_ is record3d:
        T = session.T_world_phone
        return replace(session, T_world_phone=record3d.T_PORTRAIT_PHONE @ inverse(T[0]) @ T)
    if format_ is iphumi:
        first = np.tile(session.intrinsics[0], (len(session.times), 1))
        return replace(session, intrinsics=first)
    return session


def _check_camera(format_: Format, back: CaptureSession, session: CaptureSession) -> None:
    tolerance = KEPT[format_.NAME].camera
    if tolerance is None:
        assert back.intrinsics is None
    else:
        np.testing.assert_allclose(back.intrinsics, session.intrinsics, rtol=tolerance)
    # 3D Scanner App says the size of its images by the images alone.
    sized = tolerance is not None and format_ is not scanner_3d
    assert back.image_size == (session.image_size if sized else None)


def _check_imu(format_: Format, back: CaptureSession, session: CaptureSession) -> None:
    tolerance = KEPT[format_.NAME].imu
    if tolerance is None:
        assert back.imu is None
        return
    assert back.imu is not None
    assert session.imu is not None
    np.testing.assert_allclose(back.imu.times, session.imu.times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.imu.accel, session.imu.accel, rtol=0, atol=tolerance)
    np.testing.assert_allclose(back.imu.gyro, session.imu.gyro, rtol=0, atol=tolerance)


@every_format
@settings(max_examples=8)
@given(seed=seeds, data=st.data())
def test_what_a_format_keeps_comes_back(
    wander: Callable[..., CaptureSession], format_: Format, seed: int, data: st.DataObject
):
    kept = KEPT[format_.NAME]
    session = wander(seed, seconds=1.2, rate=kept.rate)
    count = len(session.times)
    flags = np.array(data.draw(st.lists(st.booleans(), min_size=count, max_size=count)))
    with tempfile.TemporaryDirectory() as folder:
        written = write_session(format_, replace(session, tracking_ok=flags), Path(folder) / "take")
        back = read_session(written)
    session = _as_kept(format_, session)
    assert back.app == format_.NAME
    assert back.gravity_aligned is (format_ is not record3d)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=kept.times)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=kept.poses)
    _check_camera(format_, back, session)
    _check_imu(format_, back, session)
    if format_ is scan_capture:
        np.testing.assert_array_equal(back.tracking_ok, flags)
    else:
        assert back.tracking_ok is None
    if kept.video_times:
        np.testing.assert_allclose(back.video_times, session.times, rtol=0, atol=kept.times)
    else:
        assert back.video_times is None
    assert back.images is None
    assert back.depth is None


@every_format
def test_without_a_camera(take: MakeTake, tmp_path: Path, format_: Format):
    session = replace(take(0), intrinsics=None, image_size=None, video_times=None)
    back = read_session(write_session(format_, session, tmp_path))
    assert back.intrinsics is None
    assert back.image_size is None
