"""Procedural props: closed surfaces of moderate size, hands on them, everything above the floor."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.data.synthesis.props import WIDEST_HOLD, Use, make_prop
from omomo_core.data.synthesis.shapes import box, cylinder, joined

USES: tuple[Use, ...] = ("lift", "push", "one_hand")


def signed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6), size=st.tuples(*[st.floats(0.02, 1.2, allow_subnormal=False)] * 3)
)
def test_a_box_encloses_its_volume(seed: int, size: tuple[float, float, float]) -> None:
    part = box(np.random.default_rng(seed), (0.0, 0.0, 0.0), size)
    assert signed_volume(part.vertices, part.faces) == pytest.approx(np.prod(size), rel=1e-9)
    np.testing.assert_allclose(part.vertices.max(axis=0), size)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), radius=st.floats(0.02, 0.4), height=st.floats(0.02, 1.5))
def test_a_cylinder_encloses_nearly_its_volume(seed: int, radius: float, height: float) -> None:
    part = cylinder(np.random.default_rng(seed), (1.0, 2.0), 0.5, 0.5 + height, (radius, radius))
    volume = signed_volume(part.vertices, part.faces)
    assert 0.9 * np.pi * radius**2 * height < volume < np.pi * radius**2 * height


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), use=st.sampled_from(USES))
def test_props_stand_on_the_floor_and_can_be_held(seed: int, use: Use) -> None:
    prop = make_prop(np.random.default_rng(seed), use)
    vertices, faces = joined(prop.parts)
    assert vertices[:, 2].min() == pytest.approx(0.0)
    assert 40 <= len(vertices) <= 2500
    assert faces.max() == len(vertices) - 1
    for grasp in prop.grasps:
        np.testing.assert_allclose(np.linalg.norm(grasp.inward, axis=-1), 1.0)
        assert abs(grasp.points[0, 1] - grasp.points[1, 1]) <= WIDEST_HOLD + 1e-9
        assert grasp.points[0, 1] >= grasp.points[1, 1], "left palm on the left"
        for point in grasp.points:
            gaps = [np.maximum(p.low - point, point - p.high).max() for p in prop.parts]
            assert min(gaps) < 0.02, "the palm is on the surface"
