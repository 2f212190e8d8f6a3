"""Poses of boards: right, as sure as they say, and refused where they cannot be known."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.board.board_lens import distorted, undistorted
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import PRESETS
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.uncertainty import between
from tests.ingest.calibration.board.filmed import poses
from tests.simulator.witness import corner_observations

BOARD = PRESETS["A4"]
PLAIN = WitnessCamera(1500.0, 1490.0, 955.0, 548.0, size=(1920, 1080))
BENT = WitnessCamera(1500.0, 1490.0, 955.0, 548.0, (0.12, -0.25, 0.002, -0.001, 0.05), (1920, 1080))


def solved(T, camera, rng, **errors):
    pixels, numbers = corner_observations(T, BOARD, camera, rng, **errors)
    return board_poses(pixels, numbers, BOARD, camera.K, camera.lens)


def inside(found, T) -> np.ndarray:
    """Whether the truth is within the 95 % region of each pose, 6 dimensions at once."""
    step = between(found.T_camera_board, T[found.frames])
    far = np.einsum("pi,pij,pj->p", step, np.linalg.inv(found.covariance), step)
    return far < chi2.ppf(0.95, 6)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), bent=st.booleans())
def test_without_noise_poses_are_exact(seed, bent):
    rng = np.random.default_rng(seed)
    T = poses(5, rng)
    found = solved(T, BENT if bent else PLAIN, rng, sigma=0.0)
    assert found.frames.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_allclose(found.T_camera_board, T, atol=2e-6)
    assert found.rms.max() < 1e-3
    assert not found.ambiguous.any()


@pytest.mark.parametrize(
    ("camera", "errors"),
    [
        (PLAIN, {"sigma": 0.2}),
        (PLAIN, {"sigma": 1.0, "lost": 0.3}),
        (BENT, {"sigma": 0.4, "wild": 0.1}),
        (BENT, {"sigma": 3.0}),
        (PLAIN, {"sigma": 0.3, "wild": 0.25}),
    ],
)
def test_covariances_hold_and_are_not_too_wide(camera, errors):
    rng = np.random.default_rng(5)
    T = poses(600, rng)
    found = solved(T, camera, rng, **errors)
    sure = ~found.ambiguous
    assert sure.sum() > 250
    assert 0.92 < inside(found, T)[sure].mean() < 0.99
    assert found.sigma == pytest.approx(errors["sigma"], rel=0.1)


def test_blurred_frames_say_that_they_are_less_sure():
    rng = np.random.default_rng(6)
    T = poses(300, rng)
    sharp = corner_observations(T[:200], BOARD, PLAIN, rng, sigma=0.1)
    blurred = corner_observations(T[200:], BOARD, PLAIN, rng, sigma=0.8)
    found = board_poses(sharp[0] + blurred[0], sharp[1] + blurred[1], BOARD, PLAIN.K, PLAIN.lens)
    held = inside(found, T)
    assert held[:200].mean() > 0.92
    assert held[200:].mean() > 0.88


def test_it_agrees_with_opencv():
    rng = np.random.default_rng(7)
    T = poses(20, rng)
    pixels, numbers = corner_observations(T, BOARD, BENT, rng, sigma=0.3)
    found = board_poses(pixels, numbers, BOARD, BENT.K, BENT.lens)
    for k, i in enumerate(found.frames):
        R, t = found.T_camera_board[k, :3, :3], found.T_camera_board[k, :3, 3]
        start = Rotation.from_matrix(R).as_rotvec(), t.copy()
        _, turn, shift = cv2.solvePnP(
            BOARD.corners[numbers[i]], pixels[i], BENT.K, BENT.lens, *start, useExtrinsicGuess=True
        )
        # OpenCV weighs bent pixels, we weigh them to first order: the same, nearly.
        np.testing.assert_allclose(np.ravel(shift), t, atol=2e-5)
        np.testing.assert_allclose(np.ravel(turn), start[0], atol=2e-4)


def test_a_far_board_has_two_tilts_and_says_so():
    """Four metres away, perspective is too weak to tell the two ways a board may be tilted."""
    rng = np.random.default_rng(8)
    T = poses(200, rng, tilt=25)
    T[:, 2, 3] += 3.5
    found = solved(T, PLAIN, rng, sigma=0.5)
    assert found.ambiguous.mean() > 0.5
    turn = np.linalg.norm(between(found.T_camera_board, T[found.frames])[:, :3], axis=1)
    assert np.degrees(turn[~found.ambiguous]).max(initial=0) < 10
    assert np.degrees(turn[found.ambiguous]).max() > 10


def test_frames_with_too_little_are_left_out():
    rng = np.random.default_rng(9)
    T = poses(4, rng)
    pixels, numbers = corner_observations(T, BOARD, PLAIN, rng, sigma=0.1)
    keep = [slice(0, 5), slice(0, 0), np.arange(0, 24, 4), slice(None)]  # few, none, a line, all
    found = board_poses(
        [p[k] for p, k in zip(pixels, keep, strict=True)],
        [n[k] for n, k in zip(numbers, keep, strict=True)],
        BOARD,
        PLAIN.K,
        PLAIN.lens,
    )
    assert found.frames.tolist() == [3]


def test_no_frames_no_poses():
    found = board_poses([], [], BOARD, PLAIN.K, PLAIN.lens)
    assert len(found.T_camera_board) == len(found.covariance) == 0


def test_frames_that_are_all_wrong_are_left_out():
    rng = np.random.default_rng(10)
    T = poses(40, rng)
    pixels, numbers = corner_observations(T, BOARD, PLAIN, rng, sigma=0.2)
    pixels[7] = rng.uniform(0, 1000, pixels[7].shape)
    found = board_poses(pixels, numbers, BOARD, PLAIN.K, PLAIN.lens)
    assert 7 not in found.frames
    assert len(found.frames) == 39


def test_each_frame_may_have_its_own_camera():
    rng = np.random.default_rng(11)
    T = poses(6, rng)
    K = np.tile(PLAIN.K, (6, 1, 1))
    K[:, 0, 0] = K[:, 1, 1] = np.linspace(1400, 1600, 6)
    each = [
        corner_observations(
            T[i : i + 1], BOARD, WitnessCamera(k[0, 0], k[1, 1], k[0, 2], k[1, 2]), rng, sigma=0.0
        )
        for i, k in enumerate(K)
    ]
    found = board_poses([p[0] for p, _ in each], [n[0] for _, n in each], BOARD, K, np.zeros(5))
    np.testing.assert_allclose(found.T_camera_board, T, atol=1e-5)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_undistorting_undoes_the_lens(seed):
    rng = np.random.default_rng(seed)
    rays = rng.uniform(-0.6, 0.6, (30, 2))
    lens = rng.uniform(-1, 1, 5) * [0.15, 0.1, 0.003, 0.003, 0.02]
    back, slope = undistorted(distorted(rays, lens), lens)
    np.testing.assert_allclose(back, rays, atol=1e-9)
    step = rng.normal(size=2) * 1e-6
    rise = distorted(rays + step, lens) - distorted(rays, lens)
    np.testing.assert_allclose((slope @ step), rise, atol=1e-10)
