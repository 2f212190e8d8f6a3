"""Sequences of frames: runs of a mask, distances to them, and easing between rest and motion."""

import numpy as np
from jaxtyping import Bool, Float


def runs(mask: Bool[np.ndarray, " frames"]) -> list[tuple[int, int]]:
    """First and one-past-last index of every run of True."""
    padded = np.concatenate([[False], mask, [False]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(padded))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def frames_away(mask: Bool[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """How many frames the nearest True is away from each frame; infinite where there is none."""
    t, away = np.arange(len(mask)), np.full(len(mask), np.inf, np.float32)
    for start, stop in runs(mask):
        away = np.minimum(away, np.maximum(np.maximum(start - t, t - stop + 1), 0))
    return away.astype(np.float32)


def min_jerk(u: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """0 to 1 with no speed and no acceleration at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
