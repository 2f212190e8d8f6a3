"""From votes to preference rates of every two methods, without the raters who did not look."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Int
from scipy.stats import t as student

from capture_app.study.key import Key
from capture_app.study.votes import Rater


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


@dataclass(frozen=True)
class Preference:
    """How often one method was preferred to another."""

    first: str
    second: str
    rate: Rate
    """Of votes for the first."""

    @property
    def decided(self) -> bool:
        """Whether the interval leaves out that both are equal."""
        return not self.rate.low <= 0.5 <= self.rate.high


@dataclass(frozen=True)
class Analysis:
    """What a study found."""

    preferences: tuple[Preference, ...]
    kept: tuple[str, ...]
    """Names of the raters whose votes count."""
    left_out: tuple[tuple[str, str], ...]
    """Names of the others, each with why."""
    left_share: float
    """Share of counted votes for the film on the left: about one half if sides do not matter."""


def analyse(key: Key, raters: Sequence[Rater], *, may_miss: int = 0) -> Analysis:
    """Count the votes.

    Args:
        key: of the study.
        raters: each with all votes of a page.
        may_miss: attention checks that a rater may miss and still counts.
    """
    kept = [r for r in raters if r.checks_missed <= may_miss]
    out = [r for r in raters if r.checks_missed > may_miss]
    counted = [v for r in kept for v in r.votes if v.item.intact is None]
    left = sum(v.choice == "left" for v in counted)
    return Analysis(
        preferences=tuple(_between(a, b, kept) for a, b in combinations(key.methods, 2)),
        kept=tuple(r.name for r in kept),
        left_out=tuple(
            (r.name, f"missed {r.checks_missed} of {r.checks} attention checks") for r in out
        ),
        left_share=left / len(counted) if counted else 0.5,
    )


def _between(first: str, second: str, raters: Sequence[Rater]) -> Preference:
    """The vote of each kept rater on each question about two methods."""
    votes = [
        (vote.preferred == first, k, vote.item.take)
        for k, rater in enumerate(raters)
        for vote in rater.votes
        if {vote.item.left, vote.item.right} == {first, second}
    ]
    takes = {take: k for k, take in enumerate(sorted({take for *_, take in votes}))}
    rate = preference(
        [chosen for chosen, *_ in votes],
        [who for _, who, _ in votes],
        [takes[take] for *_, take in votes],
    )
    return Preference(first, second, rate)
