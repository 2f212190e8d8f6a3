"""Despiking: jumps of a sampled motion are spread over time before anything is solved.

Tokens of four frames are decoded together, so a sample may jump between two of them.
"""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from omomo_core.generation.config import DESPIKING


def despike(
    x: Float[np.ndarray, "frames channels"], points: int
) -> Float[np.ndarray, "frames channels"]:
    """Return the features smoothed over time around frames in which a point moves too fast.

    Args:
        x: any features that may be averaged over time.
        points: how many 3-vectors at the beginning of a row are positions, metres, whose speed counts.
    """
    for _ in range(DESPIKING.rounds):
        way = np.diff(x[:, : 3 * points], axis=0, append=x[-1:, : 3 * points])
        quick = (
            np.linalg.norm(way.reshape(len(x), points, 3), axis=-1).max(axis=1) > DESPIKING.fastest
        )
        if not quick.any():
            break
        near = maximum_filter1d(quick.astype(float), round(4 * DESPIKING.width))
        weight = gaussian_filter1d(near, DESPIKING.width).astype(x.dtype)[:, None]
        x = x + weight * (gaussian_filter1d(x, DESPIKING.width, axis=0, mode="nearest") - x)
    return x
