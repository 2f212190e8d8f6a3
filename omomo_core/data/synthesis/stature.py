"""People of other statures: seen from our body, their things are larger or smaller."""

import numpy as np

_OURS = 1.72
_SHORTEST, _TALLEST = 1.45, 2.0


def our_scale(rng: np.random.Generator) -> float:
    """Our stature over that of a random grown person (1.45-2.0 m)."""
    return _OURS / float(np.clip(rng.normal(1.70, 0.1), _SHORTEST, _TALLEST))
