"""Anchors lie a palm's thickness above the surface, on the side where the hand is."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.contact.contact_config import ANCHOR
from omomo_core.contact.segment import ContactSegment, ContactSpan, anchor_spans
from omomo_core.geometry.surface import Surface
from tests.core.contact.box import FRAMES, SURFACE, carried, hands, switched


@given(
    seed=st.integers(0, 500),
    side=st.integers(0, 2),
    way=st.sampled_from([-1.0, 1.0]),
    off=st.floats(0.005, 0.08),
)
@settings(max_examples=40)
def test_a_palm_outside_is_anchored_outside_however_the_scan_is_wound(
    seed: int, side: int, way: float, off: float
):
    rng = np.random.default_rng(seed)
    flips = rng.choice([-1.0, 1.0], len(SURFACE.points))
    scan = Surface(SURFACE.points, SURFACE.normals * flips[:, None], SURFACE.outline)
    palm = rng.uniform(-0.15, 0.15, 3)
    palm[side] = way * (0.2 + off)
    T = carried(seed)
    noisy = palm + rng.normal(size=(FRAMES, 3)) * 0.002
    noisy[20:25] += 0.5  # five frames astray
    predicted = hands(T, switched(FRAMES), noisy, noisy)
    (segment,) = anchor_spans([ContactSpan(0, 10, 60)], predicted, scan, T)
    assert (segment.hand, segment.start, segment.stop) == (0, 10, 60)
    assert abs(way * segment.anchor[side] - (0.2 + ANCHOR.palm_thickness)) < 1e-6
    assert np.linalg.norm(segment.anchor - palm) < 0.03 + off


def test_a_palm_inside_comes_out_along_the_normal():
    T = carried(2)
    predicted = hands(T, switched(FRAMES), np.array([0.18, 0.02, 0.05]), np.zeros(3))
    (segment,) = anchor_spans([ContactSpan(0, -5, FRAMES + 9)], predicted, SURFACE, T)
    assert abs(segment.anchor[0] - (0.2 + ANCHOR.palm_thickness)) < 1e-6


def test_an_anchor_that_is_given_stays():
    T = carried(2)
    given_one = ContactSegment(1, 3, 9, np.array([0.3, 0.2, 0.1]))
    assert anchor_spans([given_one], hands(T, switched(FRAMES)), SURFACE, T) == (given_one,)
