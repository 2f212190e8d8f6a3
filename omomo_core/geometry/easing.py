"""Smooth progress from one state to another."""

import numpy as np
from jaxtyping import Float


def min_jerk(u: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """0 to 1 with no speed and no acceleration at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
