"""Whether one method is better than another on the same windows, or only seems so."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DRAWS = 10_000


@dataclass(frozen=True)
class PairedDifference:
    """Of the means of two methods over the same windows."""

    mean: float
    low: float
    high: float
    """Of the interval that holds the middle 95 % of the draws."""


def paired_bootstrap(
    first: Sequence[float], second: Sequence[float], clips: Sequence[str], seed: int = 0
) -> PairedDifference:
    """How much greater `first` is than `second` on average.

    Whole clips are drawn with replacement, because windows of one clip overlap (paired bootstrap,
    Efron and Tibshirani 1993, of clusters).

    Args:
        first: a figure of one method in each window.
        second: of the other, in the same windows.
        clips: which clip each window is from.
        seed: of the draws.
    """
    _, clip = np.unique(np.asarray(clips), return_inverse=True)
    difference = np.asarray(first, float) - np.asarray(second, float)
    total, count = np.bincount(clip, difference), np.bincount(clip)
    times = np.random.default_rng(seed).multinomial(
        len(count), np.full(len(count), 1 / len(count)), size=DRAWS
    )
    means = (times @ total) / (times @ count)
    low, high = np.percentile(means, [2.5, 97.5])
    return PairedDifference(float(difference.mean()), float(low), float(high))
