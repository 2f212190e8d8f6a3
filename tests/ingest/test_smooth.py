"""Smoothing takes out noise, moves no pose by more than the noise, and leaves clean logs alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from ingest.formats.registry import read_session
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession
from ingest.trajectory.segments import find_breaks
from ingest.trajectory.smooth import measure_noise, resample, smooth
from ingest.trajectory.trajectory_config import SMOOTHING
from omomo_core.motion import FPS


def _with_noise(session: CaptureSession, metres: float, radians: float, seed: int = 0):
    rng = np.random.default_rng(seed)
    T = session.T_world_phone.copy()
    T[:, :3, 3] += rng.normal(scale=metres, size=(len(T), 3))
    turn = rng.normal(scale=radians, size=(len(T), 3))
    T[:, :3, :3] = T[:, :3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    return replace(session, T_world_phone=T)


def _apart(one: CaptureSession, two: CaptureSession) -> tuple[np.ndarray, np.ndarray]:
    """Metres and rad between the poses of two sessions."""
    A, B = one.T_world_phone, two.T_world_phone
    turn = Rotation.from_matrix(A[:, :3, :3].swapaxes(1, 2) @ B[:, :3, :3]).magnitude()
    return np.linalg.norm(A[:, :3, 3] - B[:, :3, 3], axis=1), turn


def _unbroken(session: CaptureSession) -> np.ndarray:
    return np.zeros(len(session.times) - 1, bool)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), rate=st.sampled_from([24.0, 30.0, 60.0, 120.0, 240.0]))
def test_a_motion_without_noise_stays_as_it_is(wander, seed: int, rate: float):
    session = wander(seed, rate=rate)
    assert smooth(session, _unbroken(session)) is session or np.array_equal(
        smooth(session, _unbroken(session)).T_world_phone, session.T_world_phone
    )


@settings(max_examples=25)
@given(
    seed=st.integers(0, 10**6),
    metres=st.floats(0, 0.02),
    radians=st.floats(0, 0.03),
    rate=st.sampled_from([30.0, 60.0, 120.0]),
)
def test_no_pose_moves_by_more_than_the_bound(wander, seed, metres, radians, rate):
    """Two standard deviations, and 2 mm and 0.3 deg, whatever the log is like."""
    session = _with_noise(wander(seed, rate=rate), metres, radians, seed)
    noise = measure_noise(session, _unbroken(session))
    assert noise is not None
    shift, turn = _apart(smooth(session, _unbroken(session)), session)
    assert shift.max() <= min(SMOOTHING.largest_shift, 2 * noise.position) + 1e-9
    assert turn.max() <= min(np.radians(SMOOTHING.largest_turn), 2 * noise.rotation) + 1e-6


@settings(max_examples=15)
@given(
    seed=st.integers(0, 10**6),
    metres=st.floats(2e-4, 1e-3),
    skipped=st.sampled_from([0.0, 0.05, 0.2]),
)
def test_white_noise_is_measured_and_made_smaller(wander, seed: int, metres: float, skipped: float):
    """Also when the app drops poses."""
    rng = np.random.default_rng(seed)
    true = wander(seed, seconds=6.0)
    keep = np.sort(rng.permutation(len(true.times))[: int(len(true.times) * (1 - skipped))])
    times, T = true.times[keep], true.T_world_phone[keep]
    true = replace(true, times=times, T_world_phone=T, intrinsics=None)
    radians = metres * 3
    noisy = _with_noise(true, metres, radians, seed)
    noise = measure_noise(noisy, _unbroken(noisy))
    assert noise is not None
    assert noise.position == pytest.approx(metres, rel=0.25)
    assert noise.rotation == pytest.approx(radians, rel=0.25)
    before, after = _apart(noisy, true), _apart(smooth(noisy, _unbroken(noisy)), true)
    for old, new in zip(before, after, strict=True):
        assert np.sqrt((new**2).mean()) < 0.85 * np.sqrt((old**2).mean())


def test_breaks_are_not_smoothed_over(wander):
    session = wander(3, seconds=4.0)
    T = session.T_world_phone.copy()
    T[100:, 0, 3] += 0.3
    session = _with_noise(replace(session, T_world_phone=T), 4e-4, 1e-3)
    broken = find_breaks(session).any
    assert np.flatnonzero(broken).tolist() == [99]
    shift, _ = _apart(smooth(session, broken), session)
    assert (shift[97:103] == 0).all()
    assert (shift[3:97] > 0).all()
    # The part before does not depend on what comes after.
    further = session.T_world_phone.copy()
    further[100:, 1, 3] += 5.0
    further = smooth(replace(session, T_world_phone=further), broken)
    np.testing.assert_allclose(
        further.T_world_phone[:100], smooth(session, broken).T_world_phone[:100], atol=1e-9
    )


@pytest.fixture(scope="module")
def ios(shared: Path) -> CaptureSession:
    return read_session(shared / "data" / "capture" / "ios_logger_pyojinkim")


def _error_of_acceleration(poses: CaptureSession, log: CaptureSession) -> float:
    """Rms m/s^2 between the poses' acceleration at 30 fps and the accelerometer's."""
    assert log.imu is not None
    T, valid = resample(poses.times, poses.T_world_phone, _unbroken(poses))
    found = np.diff(T[:, :3, 3], 2, axis=0) * FPS**2
    at = poses.times[0] + np.arange(1, len(T) - 1) / FPS
    inside = (at > log.imu.times[0] + 0.1) & (at < log.imu.times[-1] - 0.1) & valid[1:-1]
    R = Slerp(log.times, Rotation.from_matrix(log.T_world_phone[:, :3, :3]))
    # A second difference sees the acceleration through a triangle of two frames.
    delays = np.linspace(-1, 1, 21)[1:-1] / FPS
    weights = (1 / FPS - np.abs(delays)) / (1 / FPS - np.abs(delays)).sum()
    measured = np.zeros((inside.sum(), 3))
    for delay, weight in zip(delays, weights, strict=True):
        t = at[inside] + delay
        accel = np.stack([np.interp(t, log.imu.times, a) for a in log.imu.accel.T], axis=1)
        measured -= weight * R(t).apply(accel @ R_CAMERA_DEVICE.T)
    error = found[inside] - measured - [0, GRAVITY, 0]
    return float(np.sqrt(((error - np.median(error, axis=0)) ** 2).sum(axis=1).mean()))


def test_it_brings_a_real_log_nearer_to_its_accelerometer(ios: CaptureSession):
    """An independent measurement: without it smoothing would have no business being on."""
    before = _error_of_acceleration(ios, ios)
    smoothed = smooth(ios, find_breaks(ios).any)
    assert _error_of_acceleration(smoothed, ios) < 0.9 * before
    shift, turn = _apart(smoothed, ios)
    assert shift.max() < 3e-4
    assert turn.max() == 0  # ARKit's rotations are quieter than the threshold
