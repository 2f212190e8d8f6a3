"""Covariances: through inverses and products as drawn errors go, and in millimetres and degrees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.posterior import average
from ingest.uncertainty import between, bounds_95, moved, of_inverse, of_product
from omomo_core.geometry.transforms import inverse


def _pose(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.normal(size=3)
    return T


def _covariance(rng: np.random.Generator) -> np.ndarray:
    A = rng.normal(size=(6, 6)) * 1e-3
    return A @ A.T


def _draws(T: np.ndarray, covariance: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    steps = rng.multivariate_normal(np.zeros(6), covariance, n)
    return moved(np.tile(T, (n, 1, 1)), steps)


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_errors_go_through_inverse_and_product(seed: int):
    rng = np.random.default_rng(seed)
    A, B, cov_a, cov_b = _pose(rng), _pose(rng), _covariance(rng), _covariance(rng)
    a, b = _draws(A, cov_a, 4000, rng), _draws(B, cov_b, 4000, rng)
    for truth, drawn, told in [
        (inverse(A), inverse(a), of_inverse(A, cov_a)),
        (A @ B, a @ b, of_product(A, cov_a, B, cov_b)),
    ]:
        seen = np.cov(between(truth[None], drawn).T)
        scale = np.sqrt(np.outer(np.diag(told), np.diag(told)))
        np.testing.assert_allclose(seen / scale, told / scale, atol=0.12)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_between_undoes_moved(seed: int):
    rng = np.random.default_rng(seed)
    T, step = _pose(rng), rng.uniform(-1, 1, 6)
    np.testing.assert_allclose(between(T, moved(T, step)), step, atol=1e-12)


def test_bounds_hold_nineteen_of_twenty():
    rng = np.random.default_rng(3)
    covariance = _covariance(rng)
    steps = rng.multivariate_normal(np.zeros(6), covariance, 20_000)
    bounds = bounds_95(covariance)
    turned = np.degrees(np.linalg.norm(steps[:, :3], axis=1)) < bounds.deg
    shifted = 1e3 * np.linalg.norm(steps[:, 3:], axis=1) < bounds.mm
    assert turned.mean() == pytest.approx(0.95, abs=0.01)
    assert shifted.mean() == pytest.approx(0.95, abs=0.01)


def test_an_average_is_as_good_as_it_says_with_a_third_wild():
    rng = np.random.default_rng(4)
    inside = 0
    for _ in range(200):
        truth, covariance = _pose(rng), _covariance(rng) + 1e-8 * np.eye(6)
        T = _draws(truth, covariance, 12, rng)
        T[:4] = np.stack([_pose(rng) for _ in range(4)])
        found = average(T, np.tile(covariance, (12, 1, 1)))
        assert not found.kept[:4].any()
        step = between(found.T, truth)
        inside += step @ np.linalg.solve(found.covariance, step) < chi2.ppf(0.95, 6)
    assert inside / 200 > 0.91


def test_an_average_of_more_scatter_than_told_says_so():
    rng = np.random.default_rng(5)
    truth, covariance = _pose(rng), 1e-6 * np.eye(6)
    T = _draws(truth, 25 * covariance, 40, rng)
    found = average(T, np.tile(covariance, (40, 1, 1)))
    assert found.covariance[0, 0] == pytest.approx(25e-6 / 40, rel=0.5)
