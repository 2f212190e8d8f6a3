"""The pose of a camera from points of which many are mistaken."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.calibration.scan_mount import resect
from ingest.uncertainty import between

INTRINSICS = np.array([487.0, 487.0, 319.5, 239.5])


def _seen(
    rng: np.random.Generator, count: int, noise: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels, points on two walls, and the camera's pose."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.3, 3)).as_matrix()
    T[:3, 3] = rng.normal(0, 0.3, 3)
    pixels = rng.uniform([20, 20], [620, 460], (count, 2))
    depth = np.where(rng.random(count) < 0.5, 2.3, rng.uniform(1.5, 4.0, count))
    rays = np.concatenate(
        [(pixels - 0.5 - INTRINSICS[2:]) / INTRINSICS[:2], np.ones((count, 1))], 1
    )
    points = (rays * depth[:, None] - T[:3, 3]) @ T[:3, :3]
    return pixels + rng.normal(0, noise, pixels.shape), points, T


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), wrong=st.floats(0, 0.7))
def test_mistaken_points_are_left_out(seed: int, wrong: float):
    rng = np.random.default_rng(seed)
    pixels, points, T = _seen(rng, 150, 0.5)
    mistaken = rng.random(150) < wrong
    points[mistaken] = rng.permutation(points[mistaken])
    found = resect(pixels, points, INTRINSICS, (640, 480))
    assert found is not None
    step = between(found.T_camera_object, T)
    assert np.linalg.norm(step[:3]) < 0.005
    assert np.linalg.norm(step[3:]) < 0.02


@pytest.mark.parametrize("seed", range(8))
def test_a_mistake_at_the_lens_does_not_hold_the_pose(seed: int):
    rng = np.random.default_rng(seed)
    pixels, points, T = _seen(rng, 60, 0.7)
    # A pose that brings this point to its pixel costs the others little and shuts in the rest.
    at_lens = np.array([0.01, -0.02, -0.03])
    points[0] = (at_lens - T[:3, 3]) @ T[:3, :3]
    found = resect(pixels, points, INTRINSICS, (640, 480))
    assert found is not None
    assert not found.inlier[0]
    assert np.linalg.norm(between(found.T_camera_object, T)[3:]) < 0.03


def test_points_that_err_by_themselves_stay_within_the_bounds():
    surprises = []
    for seed in range(60):
        pixels, points, T = _seen(np.random.default_rng(seed), 25, 0.7)
        found = resect(pixels, points, INTRINSICS, (640, 480))
        assert found is not None
        step = between(found.T_camera_object, T)
        surprises.append(step @ np.linalg.solve(found.covariance, step))
    assert np.mean(np.array(surprises) < 12.6) >= 0.9
    assert 4 < np.mean(surprises) < 9


def test_nothing_in_common():
    rng = np.random.default_rng(0)
    pixels, points, _ = _seen(rng, 60, 0.5)
    found = resect(pixels, rng.normal(size=points.shape), INTRINSICS, (640, 480))
    assert found is None or found.inlier.sum() < 15
