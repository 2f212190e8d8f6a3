"""Known preferences are found again, and the interval is as sure as it says."""

import math

import numpy as np
import pytest

from capture_app.study.study_design import Plan
from capture_app.study.study_report import analyse, preference

from .conftest import Crowd, make_key


@pytest.mark.parametrize(
    ("studies", "least"), [(24, 0.8), pytest.param(300, 0.92, marks=pytest.mark.slow)]
)
def test_known_preferences_lie_within_the_interval_as_often_as_it_says(
    crowd: Crowd, studies: int, least: float
) -> None:
    key = make_key(Plan(raters=20, pairs=30))
    inside = {pair: 0 for pair in crowd.preferred}
    width = {pair: [] for pair in crowd.preferred}
    for seed in range(studies):
        found = analyse(key, crowd.vote(key, np.random.default_rng(seed)))
        for p in found.preferences:
            true = crowd.preferred[p.first, p.second]
            inside[p.first, p.second] += p.rate.low <= true <= p.rate.high
            width[p.first, p.second].append(p.rate.high - p.rate.low)
    coverage = {pair: count / studies for pair, count in inside.items()}
    assert min(coverage.values()) > least
    assert all(np.mean(w) < 0.27 for w in width.values())  # and says something


def test_an_interval_for_independent_votes_would_not_do(crowd: Crowd) -> None:
    """The crossed clusters are what makes the test above pass."""
    key = make_key(Plan(raters=15, pairs=20))
    inside = 0
    for seed in range(20):
        rate = analyse(key, crowd.vote(key, np.random.default_rng(seed))).preferences[0].rate
        alone = 1.96 * math.sqrt(rate.share * (1 - rate.share) / rate.votes)
        inside += abs(rate.share - 0.8) <= alone
    assert inside / 20 < 0.8


def test_who_does_not_look_is_named_and_left_out() -> None:
    key = make_key(Plan(raters=40, pairs=10, checks=6))
    crowd = Crowd(
        {("ours", "rule"): 0.9, ("ours", "recorded"): 0.5, ("rule", "recorded"): 0.2}, 0.3
    )
    rng = np.random.default_rng(1)
    raters = crowd.vote(key, rng)
    found = analyse(key, raters)
    bad = {r.name for r in raters if r.checks_missed}
    assert 6 <= len(bad) <= 18
    assert {name for name, _ in found.left_out} == bad
    assert set(found.kept) == {r.name for r in raters} - bad
    assert all("of 6 attention checks" in why for _, why in found.left_out)
    assert len(analyse(key, raters, may_miss=6).kept) == 40


def test_votes_by_side_alone_show_as_such() -> None:
    key = make_key(Plan(raters=4, pairs=10, checks=0))
    crowd = Crowd({("ours", "rule"): 0.5, ("ours", "recorded"): 0.5, ("rule", "recorded"): 0.5})
    raters = [
        type(r)(r.name, r.page, tuple(type(v)(v.item, "left") for v in r.votes))
        for r in crowd.vote(key, np.random.default_rng(0))
    ]
    found = analyse(key, raters)
    assert found.left_share == 1.0
    for p in found.preferences:  # sides are balanced, so nobody wins by them
        assert p.rate.share == 0.5
        assert not p.decided


def test_the_interval_of_independent_votes_is_wilsons() -> None:
    """60 of 100, each by another person on another question: 0.502 to 0.691 (z), a little wider (t)."""
    rate = preference([True] * 60 + [False] * 40, list(range(100)), list(range(100)))
    assert rate.low == pytest.approx(0.5020, abs=0.003)
    assert rate.high == pytest.approx(0.6906, abs=0.003)


def test_people_who_all_vote_as_one_count_once() -> None:
    """Ten people who each always say the same: no more is known than from ten votes."""
    chosen = [person < 6 for person in range(10) for _ in range(20)]
    who = [person for person in range(10) for _ in range(20)]
    each = preference([k < 6 for k in range(10)], list(range(10)), list(range(10)))
    rate = preference(chosen, who, list(range(20)) * 10)
    assert rate.share == each.share
    assert rate.high - rate.low == pytest.approx(each.high - each.low, rel=0.12)


@pytest.mark.parametrize("all_of_them", [True, False])
def test_unanimous_votes_leave_room_on_one_side_only(all_of_them: bool) -> None:
    rate = preference([all_of_them] * 40, [k // 4 for k in range(40)], [k % 4 for k in range(40)])
    assert rate.share == float(all_of_them)
    assert (rate.high == 1.0) == all_of_them
    assert (rate.low == 0.0) == (not all_of_them)
    assert rate.high - rate.low > 0.05


def test_no_votes_tell_nothing() -> None:
    assert (preference([], [], []).low, preference([], [], []).high) == (0.0, 1.0)
