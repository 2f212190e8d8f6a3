"""What is a leap of a sampled motion, and how far it is spread; how long what is decided pulls."""

import numpy as np
import pytest
import torch

from omomo_core.generation.decoding import despike
from omomo_core.generation.generation_options import FeaturePrefix, fade


@pytest.mark.parametrize(("metres", "leaps"), [(0.118, False), (0.122, True)])
def test_twelve_centimetres_in_a_frame_are_a_leap(metres: float, leaps: bool):
    x = np.zeros((80, 8))
    x[40:, 3:5] = metres / np.sqrt(2)
    assert (despike(x, 2) != x).any() == leaps
    # What is no place may change as it likes.
    other = np.zeros((80, 8))
    other[40:, 6:] = 9.0
    np.testing.assert_array_equal(despike(other, 2), other)


def test_a_leap_of_thirty_centimetres_takes_half_a_second():
    x = np.zeros((120, 3))
    x[60:, 0] = 0.3
    steps = np.diff(despike(x, 1)[:, 0])
    # A Gaussian's four frames: nineteen of more than a millimetre, four centimetres at most.
    assert (steps > 1e-3).sum() == 19
    assert 0.040 < steps.max() < 0.045
    assert steps.min() >= -1e-12


def test_what_is_decided_pulls_on_the_twenty_frames_after_it():
    assert fade(30)[0] == 1.0
    assert fade(30)[10] == pytest.approx(0.5)
    assert fade(30)[19] > 0
    assert (fade(30)[20:] == 0).all()
    pinned = FeaturePrefix.all(torch.ones(1, 5, 2)).impose(torch.zeros(1, 40, 2))
    assert (pinned[0, :5] == 1).all()
    assert pinned[0, 14, 0] == pytest.approx(0.5)
    assert (pinned[0, 24:] == 0).all()
    half = FeaturePrefix(torch.ones(1, 5, 2), torch.tensor([True, False]), fade=10)
    held = half.impose(torch.zeros(1, 40, 2))
    assert (held[0, :, 1] == 0).all()
    assert held[0, 9, 0] == pytest.approx(0.5)
