"""Stretches of frames in which something holds."""

import numpy as np
from jaxtyping import Bool


def runs(mask: Bool[np.ndarray, " frames"]) -> list[tuple[int, int]]:
    """First and one-past-last index of every run of True."""
    padded = np.concatenate([[False], mask, [False]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(padded))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
