"""The path of a palm from one place of an object to another."""

import numpy as np
import pytest

from omomo_core.contact.segment import along, length_of, path_between
from tests.core.contact.box import LEFT, NOTHING, RIGHT, SURFACE

TOP, SAME_FACE = np.array([0.02, 0.05, 0.23]), np.array([-0.23, -0.12, 0.1])


@pytest.mark.parametrize(("a", "b"), [(LEFT, RIGHT), (RIGHT, LEFT), (LEFT, TOP), (TOP, RIGHT)])
def test_a_palm_goes_around_a_box_from_one_face_to_another(a: np.ndarray, b: np.ndarray):
    path = path_between(a, b, SURFACE)
    np.testing.assert_allclose(path[[0, -1]], [a, b], atol=1e-9)
    fine = along(path, np.linspace(0, 1, 200))
    inside = (np.abs(fine) < 0.2).all(axis=1)
    assert not inside.any()
    assert length_of(path) < 2.2 * np.linalg.norm(b - a)


def test_a_palm_that_nothing_hinders_goes_straight():
    for a, b, surface in ((LEFT, RIGHT, NOTHING), (LEFT, SAME_FACE, SURFACE)):
        path = path_between(a, b, surface)
        assert length_of(path) == pytest.approx(np.linalg.norm(b - a))


def test_a_path_to_the_same_place_has_no_length():
    assert length_of(path_between(LEFT, LEFT, SURFACE)) == 0.0
