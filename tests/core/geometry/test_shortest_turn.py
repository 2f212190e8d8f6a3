"""The shortest turn between two directions, at every angle from none to half a turn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.geometry.transforms import shortest_turn

_SIZE = st.floats(0.01, 100.0)


@given(
    seed=st.integers(0, 10**6),
    angle=st.one_of(
        st.floats(0.0, np.pi),
        st.floats(-17.0, -1.0).map(lambda e: 10.0**e),
        st.floats(-17.0, -1.0).map(lambda e: np.pi - 10.0**e),
    ),
    sizes=st.tuples(_SIZE, _SIZE),
)
def test_turns_by_the_angle_between(seed: int, angle: float, sizes: tuple[float, float]):
    """About the axis square to both, however near they are to one line."""
    old, axis = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 2)))[0].T
    new = Rotation.from_rotvec(axis * angle).apply(old)
    R = shortest_turn(old * sizes[0], new * sizes[1])
    np.testing.assert_allclose(R @ old, new, atol=1e-12)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert Rotation.from_matrix(R).magnitude() == pytest.approx(angle, abs=1e-7)


@pytest.mark.parametrize("line", [*np.eye(3), -np.eye(3)[1], np.array([1.0, 1.0, 0.0])])
def test_half_a_turn(line: np.ndarray):
    R = shortest_turn(line, -line)
    np.testing.assert_allclose(R @ line, -line, atol=1e-15)
    assert np.linalg.det(R) == pytest.approx(1.0)
