"""How sure a preference rate is, when the same raters vote often and on the same questions.

Wilson's score interval (Wilson 1927) with as many votes as would carry the same information were they
independent, and Student's quantile for the number of clusters (Korn and Graubard 1998). The variance
is that of two crossed clusters, raters and questions (Cameron, Gelbach and Miller 2011).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int
from scipy.stats import t as student


@dataclass(frozen=True)
class Rate:
    """A share and the interval it lies in with 95 % confidence, 0 to 1."""

    share: float
    low: float
    high: float
    votes: int


def preference(chosen: Sequence[bool], raters: Sequence[int], questions: Sequence[int]) -> Rate:
    """The share of votes for one of two methods.

    Args:
        chosen: for each vote, whether it is for that method.
        raters, questions: for each vote, an index of who voted on what.

    Returns:
        The rate; without a vote, 0.5 between 0 and 1.
    """
    votes = np.array(chosen, bool)
    n = len(votes)
    if n == 0:
        return Rate(0.5, 0.0, 1.0, 0)
    who, what = (
        np.unique(raters, return_inverse=True)[1],
        np.unique(questions, return_inverse=True)[1],
    )
    clusters = min(int(who.max()), int(what.max())) + 1
    share = float(votes.mean())
    alone = share * (1 - share) / n
    together = _variance(votes, who) + _variance(votes, what) - alone
    effective = n * min(1.0, alone / together) if alone > 0 and together > 0 else float(n)
    q = float(student.ppf(0.975, max(1, clusters - 1)))
    return Rate(share, *_wilson(share, max(effective, 1.0), q), n)


def _variance(votes: Bool[np.ndarray, " votes"], cluster: Int[np.ndarray, " votes"]) -> float:
    """Of the mean, when votes of one cluster go together."""
    sums = np.bincount(cluster, votes - votes.mean())
    g = len(sums)
    if g < 2:
        return 0.0
    return float(g / (g - 1) * (sums**2).sum()) / len(votes) ** 2


def _wilson(share: float, n: float, q: float) -> tuple[float, float]:
    middle = share + q * q / (2 * n)
    reach = q * np.sqrt(share * (1 - share) / n + q * q / (4 * n * n))
    scale = 1 + q * q / n
    return max(0.0, float(middle - reach) / scale), min(1.0, float(middle + reach) / scale)
