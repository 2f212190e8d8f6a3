"""The nearest rotation, on noisy rotations and on mirrored matrices."""

import numpy as np
from scipy.spatial.transform import Rotation

from omomo_core.geometry.transforms import nearest_rotation


def test_a_rotation_with_noise_gets_the_rotation_that_scipy_finds():
    rng = np.random.default_rng(0)
    M = Rotation.random(20, rng=rng).as_matrix() + rng.normal(0, 0.01, (20, 3, 3))
    np.testing.assert_allclose(nearest_rotation(M), Rotation.from_matrix(M).as_matrix(), atol=1e-4)


def test_a_mirrored_matrix_gets_a_rotation_and_not_its_mirror_image():
    R = nearest_rotation(np.diag([3.0, 2.0, -1.0]))
    np.testing.assert_allclose(R, np.eye(3), atol=1e-12)


def test_it_is_the_kabsch_solution_of_pairs_of_vectors():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 10, 3))
    expected, _ = Rotation.align_vectors(a, b)
    np.testing.assert_allclose(nearest_rotation(a.T @ b), expected.as_matrix(), atol=1e-9)
