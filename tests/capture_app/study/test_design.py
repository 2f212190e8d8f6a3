"""What is drawn: every pair before every rater, sides in balance, the same for the same seed."""

from collections import Counter
from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from capture_app.study.study_design import Page, Plan, design
from omomo_core.errors import InputError

TAKES = [f"t{k}" for k in range(12)]
METHODS = ["a", "b", "c"]


def asked(page: Page):
    return [i for i in page.items if i.intact is None]


@settings(max_examples=40)
@given(
    raters=some.integers(1, 9),
    pairs=some.integers(1, 12),
    checks=some.integers(0, 5),
    per_page=some.integers(1, 40),
    seed=some.integers(0, 10**6),
)
def test_every_question_comes_once_before_each_rater_and_sides_balance(
    raters: int, pairs: int, checks: int, per_page: int, seed: int
) -> None:
    pages = design(TAKES, METHODS, Plan(raters, pairs, checks, per_page, seed))
    times = Counter(i.question for page in pages for i in asked(page))
    assert set(times.values()) == {raters}
    assert len(times) == 3 * pairs
    assert Counter((q.first, q.second) for q in times) == dict.fromkeys(
        combinations(METHODS, 2), pairs
    )
    left = Counter(i.question for page in pages for i in asked(page) if i.left == i.question.first)
    assert all(abs(2 * left[q] - raters) <= 1 for q in times)
    for page in pages:
        assert 1 <= len(asked(page)) <= per_page
        assert len({i.question for i in asked(page)}) == len(asked(page))
        intact = Counter(i.intact for i in page.items if i.intact is not None)
        assert intact.total() == checks
        assert abs(intact["left"] - intact["right"]) <= 1
        for two in combinations(METHODS, 2):
            same = [i for i in asked(page) if (i.question.first, i.question.second) == two]
            first = sum(i.left == two[0] for i in same)
            assert abs(2 * first - len(same)) <= 1


def test_the_seed_decides() -> None:
    assert design(TAKES, METHODS, Plan(seed=3, pairs=9)) == design(
        TAKES, METHODS, Plan(seed=3, pairs=9)
    )
    assert design(TAKES, METHODS, Plan(seed=3, pairs=9)) != design(
        TAKES, METHODS, Plan(seed=4, pairs=9)
    )


def test_raters_see_their_pairs_in_different_orders() -> None:
    pages = design(TAKES, METHODS, Plan(raters=5, pairs=10))
    orders = {tuple((i.question.take, i.question.first) for i in asked(p)) for p in pages}
    assert len(orders) == 5


def test_more_pairs_than_takes_are_refused() -> None:
    with pytest.raises(InputError, match="12 takes") as caught:
        design(TAKES, METHODS, Plan(pairs=13))
    assert caught.value.code == "study-few-takes"
