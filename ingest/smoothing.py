"""Derivatives of noisy signals, and how two signals lie over each other.

They are those of `scipy.signal`, which takes half a second to import at the start of every command.
"""

from math import factorial

import numpy as np
from jaxtyping import Float64
from numpy.polynomial.polynomial import polyder, polyval
from scipy.fft import irfft, next_fast_len, rfft
from scipy.ndimage import correlate1d


def derivative_weights(
    width: int, order: int, derivative: int = 0
) -> Float64[np.ndarray, " width"]:
    """Weights of the samples around one for its derivative per sample (Savitzky and Golay 1964).

    Args:
        width: how many samples, an odd number.
        order: of the polynomial that is fitted to them.
        derivative: 0 is the smoothed value itself.
    """
    return factorial(derivative) * _fit(width, order)[derivative]


def smooth_derivative(
    x: Float64[np.ndarray, "samples axes"], width: int, order: int, derivative: int = 0
) -> Float64[np.ndarray, "samples axes"]:
    """Derivative of a signal by polynomials around each sample; the first and the last serve for the ends.

    Args:
        x: at least `width` samples.
        width, order, derivative: see `derivative_weights`.
    """
    weights, half = derivative_weights(width, order, derivative), width // 2
    out = np.asarray(correlate1d(x, weights, axis=0))
    at = np.arange(width) - half
    for window, ends in ((slice(width), at < 0), (slice(-width, None), at > 0)):
        fitted = polyder(_fit(width, order) @ x[window], derivative)
        out[window][ends] = polyval(at[ends], fitted).T
    return out


def cross_correlation(
    a: Float64[np.ndarray, " n"], b: Float64[np.ndarray, " m"]
) -> Float64[np.ndarray, " shifts"]:
    """Sum of products of two signals at every shift, of 1 - m to n - 1 samples."""
    count = len(a) + len(b) - 1
    length = next_fast_len(count, real=True)
    both = np.asarray(rfft(a, length)) * np.asarray(rfft(b[::-1], length))
    return np.asarray(irfft(both, length))[:count]


def _fit(width: int, order: int) -> Float64[np.ndarray, "powers width"]:
    """Coefficients of the polynomial of least squares, from samples around 0."""
    at = np.arange(width) - width // 2
    return np.linalg.pinv(at[:, None].astype(float) ** np.arange(order + 1))
