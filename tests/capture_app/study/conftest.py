"""Raters who are simulated: what they prefer is known."""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import pytest

from capture_app.study.study_design import Plan, design
from capture_app.study.study_pages import answer_key
from capture_app.study.votes import Key, Rater, Vote

METHODS = ("ours", "rule", "recorded")
TAKES = tuple(f"take {k:02d}" for k in range(30))
_NORMAL = NormalDist()


def make_key(plan: Plan, methods=METHODS, takes=TAKES) -> Key:
    return answer_key(design(takes, methods, plan), methods, plan)


@dataclass(frozen=True)
class Crowd:
    """People who differ, looking at takes that differ.

    Of votes between two methods, `preferred[first, second]` is the share for the first over all people and
    takes there could be.
    """

    preferred: dict[tuple[str, str], float]
    inattentive: float = 0.0
    people_differ: float = 0.5
    takes_differ: float = 0.5

    def vote(self, key: Key, rng: np.random.Generator) -> list[Rater]:
        spread = np.sqrt(1 + self.people_differ**2 + self.takes_differ**2)
        means = {pair: _NORMAL.inv_cdf(p) * spread for pair, p in self.preferred.items()}
        take = {t: rng.normal(0, self.takes_differ) for t in TAKES}
        raters = []
        for page in key.pages:
            asleep = rng.uniform() < self.inattentive
            person = rng.normal(0, self.people_differ)
            votes = []
            for item in page.items:
                if asleep:
                    left = rng.uniform() < 0.5
                elif item.intact is not None:
                    left = item.intact == "left"
                else:
                    pair = (item.left, item.right)
                    turned = pair not in self.preferred
                    mean = means[pair[::-1] if turned else pair] + person + take[item.take]
                    left = (rng.uniform() < _NORMAL.cdf(mean)) != turned
                votes.append(Vote(item, "left" if left else "right"))
            raters.append(Rater(f"votes_{page.id}.json", page, tuple(votes)))
        return raters


@pytest.fixture
def crowd() -> Crowd:
    return Crowd(
        {("ours", "rule"): 0.8, ("ours", "recorded"): 0.31, ("rule", "recorded"): 0.12}, 0.2
    )
