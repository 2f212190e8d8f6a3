"""A pose from picked points: right within its bounds, and no wrong one from wrong points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.point_pairs import PointFit, rigid_from_points
from ingest.uncertainty import between, bounds_95
from omomo_core.errors import InputError

SOLID = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.25, 0], [0.05, 0.1, 0.2], [0.2, 0.2, 0.1]])


def _pose(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.normal(size=3) * 0.3
    return T


def _seen(T: np.ndarray, b: np.ndarray, scale: float = 1.0) -> np.ndarray:
    return scale * b @ T[:3, :3].T + T[:3, 3]


def _error(a: np.ndarray, b: np.ndarray, **more: object) -> InputError:
    with pytest.raises(InputError) as caught:
        rigid_from_points(a, b, **more)  # pyright: ignore[reportArgumentType]
    return caught.value


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(0.001, 1000))
def test_exact_points_give_the_exact_pose_and_scale(seed: int, scale: float):
    rng = np.random.default_rng(seed)
    T = _pose(rng)
    a = _seen(T, SOLID)
    fit = rigid_from_points(a, SOLID)
    np.testing.assert_allclose(fit.T_a_b, T, atol=1e-10)
    assert fit.kept.all()
    assert not fit.flat
    assert not fit.loose
    scaled = rigid_from_points(a, SOLID / scale, scaled=True)
    np.testing.assert_allclose(scaled.T_a_b, T, atol=1e-9)
    assert scaled.scale == pytest.approx(scale)


@pytest.mark.parametrize("scaled", [False, True])
@pytest.mark.parametrize("count", [3, 4, 12])
def test_the_truth_is_inside_the_bounds(count: int, scaled: bool):
    rng = np.random.default_rng(count)
    inside = np.zeros(3)
    tries = 200
    for _ in range(tries):
        T, scale = _pose(rng), rng.uniform(0.5, 2.0) if scaled else 1.0
        b = SOLID[:3] if count == 3 else rng.normal(size=(count, 3)) * 0.12
        a = _seen(T, b, scale) + rng.normal(size=b.shape) * 0.002
        fit = rigid_from_points(a, b, scaled=scaled)
        inside += _inside(fit, T)
    assert (inside / tries > 0.92).all()
    # One chi-square of 6 numbers, so the covariance is not wider than the errors either.
    assert inside[2] / tries < 0.99


def _inside(fit: PointFit, T: np.ndarray) -> np.ndarray:
    step, bounds = between(fit.T_a_b, T), bounds_95(fit.covariance)
    return np.array(
        [
            1e3 * np.linalg.norm(step[3:]) < bounds.mm,
            np.degrees(np.linalg.norm(step[:3])) < bounds.deg,
            step @ np.linalg.solve(fit.covariance, step) < chi2.ppf(0.95, 6),
        ]
    )


def test_points_worse_than_stated_are_believed_to_be_worse():
    rng = np.random.default_rng(1)
    inside, tries = np.zeros(3), 200
    for _ in range(tries):
        T = _pose(rng)
        b = rng.normal(size=(8, 3)) * 0.2
        fit = rigid_from_points(_seen(T, b) + rng.normal(size=b.shape) * 0.008, b)
        assert fit.loose
        inside += _inside(fit, T)
    assert (inside[:2] / tries > 0.93).all()


def test_a_sigma_per_pair_weighs():
    T = _pose(np.random.default_rng(2))
    a = _seen(T, SOLID)
    a[0] += 0.03
    fit = rigid_from_points(a, SOLID, np.array([0.05, 1e-4, 1e-4, 1e-4, 1e-4]))
    assert fit.kept.all()
    np.testing.assert_allclose(fit.T_a_b, T, atol=1e-4)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), which=st.integers(0, 4))
def test_one_wild_pair_is_left_out(seed: int, which: int):
    rng = np.random.default_rng(seed)
    T = _pose(rng)
    b = rng.uniform(-0.2, 0.2, (7, 3))
    a = _seen(T, b) + rng.normal(size=b.shape) * 0.0005
    away = rng.normal(size=3)
    a[which] += 0.15 * away / np.linalg.norm(away)
    fit = rigid_from_points(a, b, 0.001)
    assert list(np.flatnonzero(~fit.kept)) == [which]
    assert fit.residuals[which] > 0.1
    assert fit.rms < 0.003
    assert np.abs(between(fit.T_a_b, T)).max() < 0.02


def test_a_wrong_pair_that_could_be_any_is_refused_by_name():
    a = _seen(_pose(np.random.default_rng(3)), SOLID[:3])
    a[1] += 0.05 * (a[1] - a[0]) / np.linalg.norm(a[1] - a[0])
    error = _error(a, SOLID[:3])
    assert error.code == "points-wild"
    assert "50 mm" in error.what
    square = np.array([[0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0], [0, 0.2, 0]])
    lifted = square.copy()
    lifted[3, 2] += 0.06
    named = _error(lifted, square, names=["lens", "left", "right", "top"])
    assert named.code == "points-wild"
    assert "top" in named.what


def test_too_few_and_not_finite():
    assert _error(SOLID[:2], SOLID[:2]).code == "points-few"
    assert _error(np.zeros((0, 3)), np.zeros((0, 3))).code == "points-few"
    bad = SOLID.copy()
    bad[3, 1] = np.nan
    error = _error(bad, SOLID)
    assert error.code == "points-not-finite"
    assert "pair 4" in error.what


@pytest.mark.parametrize("beside", [0.0, 0.003])
def test_points_in_a_line_name_the_open_turn(beside: float):
    line = np.outer([0, 0.1, 0.25, 0.4], [1.0, 2.0, -1.0])
    line[1] += [beside, 0, 0]
    error = _error(line, line)
    assert error.code == "points-collinear"
    assert "turn about the line" in error.what
    assert _error(_seen(np.eye(4), line, 3.0), line, scaled=True).code == "points-collinear"


def test_all_points_at_one_spot_are_refused():
    spot = np.ones((4, 3)) + np.diag([1e-4, 2e-4, 3e-4, 0])[:, :3]
    assert _error(spot, spot).code == "points-collinear"


def test_duplicates():
    twice = np.concatenate([SOLID[:3], SOLID[:1]])
    assert _error(twice, twice).code == "points-duplicate"
    moved = np.concatenate([SOLID[:3], SOLID[:1] + 0.08])
    for error in (_error(twice, moved), _error(moved, twice)):
        assert error.code == "points-duplicate"
        assert "pair 1 and pair 4" in error.what
        assert "138.6 mm" in error.what


def test_one_point_measured_twice_is_not_a_duplicate():
    a = np.concatenate([SOLID, SOLID[:1]])
    b = np.concatenate([SOLID, SOLID[:1] + 0.001])
    assert rigid_from_points(a, b).kept.all()


def test_a_left_handed_frame_is_told_unless_the_points_are_flat():
    error = _error(SOLID, SOLID * [1, 1, -1])
    assert error.code == "points-mirrored"
    flat = SOLID[:3]
    assert rigid_from_points(flat, flat * [-1, 1, 1]).flat
    assert not rigid_from_points(SOLID, SOLID).flat


@pytest.mark.parametrize(("factor", "unit"), [(1000, "millimetres"), (100, "centimetres")])
def test_units(factor: float, unit: str):
    for error in (_error(SOLID * factor, SOLID), _error(SOLID, SOLID * factor)):
        assert error.code == "points-units"
        assert unit in error.what
    first = _error(SOLID * factor, SOLID)
    assert "first" in first.what


def test_a_mesh_of_another_scale_is_told_the_scale():
    error = _error(SOLID, SOLID / 1.2)
    assert error.code == "points-scale"
    assert "1.2" in error.what
