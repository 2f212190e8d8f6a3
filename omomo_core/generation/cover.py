"""Some of many guesses that stand for all of them.

Guesses of the palms are cheap and bodies are not: more are drawn than bodies are made, and those kept
are the ones around which the others lie (greedy facility location). One alone is the medoid.
"""

import numpy as np
from jaxtyping import Float, Int

DRAWN, FEWEST, MOST = 3, 8, 100
"""Guesses for each that is kept; at least and at most."""
STRIDE = 4
"""Frames between those that are compared."""


def guesses(samples: int) -> int:
    """How many to draw where so many are kept."""
    return max(samples, min(max(DRAWN * samples, FEWEST), MOST))


def cover(
    palms: Float[np.ndarray, "guesses frames 2 3"], samples: int
) -> Int[np.ndarray, " samples"]:
    """Indices of the guesses to keep, the most telling first.

    Each lowers most the sum, over all guesses, of the mean distance between the palms of a guess and
    those of the nearest that is kept.

    Args:
        palms: metres, in any axes that all guesses share.
        samples: how many to keep.
    """
    seen = palms[:, ::STRIDE]
    apart = np.stack([np.linalg.norm(seen - one, axis=-1).mean(axis=(1, 2)) for one in seen])
    kept: list[int] = []
    nearest = np.full(len(palms), np.inf)
    for _ in range(samples):
        left = np.minimum(nearest, apart).sum(axis=1)
        left[kept] = np.inf
        kept.append(int(left.argmin()))
        nearest = np.minimum(nearest, apart[kept[-1]])
    return np.array(kept)
