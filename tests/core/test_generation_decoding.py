"""From sampled features to targets: how far arms follow their palms."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from omomo_core.generation.decoding import arms_follow
from omomo_core.generation.generation_config import BODY_DECODING


@settings(max_examples=50)
@given(arrays.arrays(float, (2, 40, 2), elements=st.sampled_from([0.0, 0.5, 1.0])))
def test_arms_follow_palms_wholly_while_they_hold_and_never_less_than_they_touch(
    contact: np.ndarray,
):
    follow = arms_follow(contact)
    np.testing.assert_array_equal(follow[contact == 1], 1.0)
    assert (follow >= contact).all()
    assert follow.max() <= 1.0


def test_arms_come_and_go_over_half_a_second_each_by_itself():
    contact = np.zeros((2, 80, 2))
    contact[0, 30:50, 0] = 1.0
    follow = arms_follow(contact)
    np.testing.assert_array_equal(follow[1], 0.0)
    np.testing.assert_array_equal(follow[0, :, 1], 0.0)
    left, width = follow[0, :, 0], BODY_DECODING.following
    assert (np.flatnonzero(left > 0)[[0, -1]] == (30 - width + 1, 49 + width - 1)).all()
    assert np.abs(np.diff(left)).max() < 2 / width
    np.testing.assert_allclose(left[:30], left[:49:-1])
