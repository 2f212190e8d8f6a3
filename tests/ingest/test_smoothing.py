"""Savitzky and Golay's derivatives and cross-correlation, as scipy.signal has them."""

import numpy as np
import pytest
from scipy import signal

from ingest.smoothing import cross_correlation, derivative_weights, smooth_derivative


@pytest.mark.parametrize("samples", [11, 12, 40])
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_derivatives_are_those_of_scipy(samples: int, derivative: int):
    x = np.random.default_rng(samples).normal(size=(samples, 3))
    ours = smooth_derivative(x, 11, 3, derivative)
    np.testing.assert_allclose(ours, signal.savgol_filter(x, 11, 3, derivative, axis=0), atol=1e-12)


def test_weights_are_those_of_scipy():
    theirs = signal.savgol_coeffs(11, 3, deriv=2, use="dot")
    np.testing.assert_allclose(derivative_weights(11, 3, 2), theirs, atol=1e-12)


@pytest.mark.parametrize(("m", "n"), [(1, 1), (7, 30), (200, 55)])
def test_correlation_at_every_shift_is_that_of_scipy(m: int, n: int):
    a, b = np.random.default_rng(m).normal(size=m), np.random.default_rng(n).normal(size=n)
    np.testing.assert_allclose(cross_correlation(a, b), signal.correlate(a, b), atol=1e-10)
