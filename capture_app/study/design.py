"""Which pairs a study shows, to whom, in which order, and which film stands on the left."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from omomo_core.errors import InputError

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Plan:
    """Numbers of a study: raters, questions, checks, and the seed."""

    raters: int = 20
    """People who answer each question."""
    pairs: int = 30
    """Questions for each two methods."""
    checks: int = 4
    """Attention checks on each page."""
    per_page: int = 40
    """Most questions on a page, checks not counted."""
    seed: int = 0


@dataclass(frozen=True)
class Question:
    """Which of two methods' films of a take is better."""

    take: str
    first: str
    second: str
    """Names of methods."""


@dataclass(frozen=True)
class Trial:
    """A question as one page shows it."""

    question: Question
    left: str
    """Method on the left; the other is on the right."""
    intact: Side | None = None
    """In a check, where both films are of one method, the side that was not broken."""


@dataclass(frozen=True)
class Page:
    """What one rater sees, in order."""

    batch: int
    items: tuple[Trial, ...]


def design(takes: Sequence[str], methods: Sequence[str], plan: Plan) -> list[Page]:
    """Draw the questions of every two methods and lay them on pages, one for each rater.

    Each question comes once before each of `raters` people, with either method on the left for half
    of them; on each page, of the questions on the same two methods, half have the same one on the
    left. Both hold to within one.

    Args:
        takes: those that every method has.
        methods: two or more.
        plan: how many; the seed decides everything that is drawn.

    Raises:
        InputError: there are fewer takes than pairs.
    """
    if plan.pairs > len(takes):
        raise InputError(
            "study-few-takes",
            f"{plan.pairs} pairs are wanted, but the methods have {len(takes)} takes in common.",
            where="--pairs",
            fix=f"Ask for at most {len(takes)} pairs, or make results of more takes.",
        )
    rng = np.random.default_rng(plan.seed)
    questions = _questions(takes, methods, plan, rng)
    batches = -(-len(questions) // plan.per_page)
    return [
        page
        for batch in range(batches)
        for page in _pages(batch, questions[batch::batches], plan, methods, rng)
    ]


def _questions(
    takes: Sequence[str], methods: Sequence[str], plan: Plan, rng: np.random.Generator
) -> list[Question]:
    """In the order of the methods' pairs, so that batches get equal shares of each."""
    return [
        Question(takes[int(k)], first, second)
        for first, second in combinations(methods, 2)
        for k in rng.choice(len(takes), plan.pairs, replace=False).tolist()
    ]


def _pages(
    batch: int,
    questions: Sequence[Question],
    plan: Plan,
    methods: Sequence[str],
    rng: np.random.Generator,
) -> list[Page]:
    """The same questions before different people."""
    swapped = _balanced(questions, rng)
    # The checks are of takes that the batch shows anyway: their films are there.
    used = sorted({q.take for q in questions})
    pages: list[Page] = []
    for rater in range(plan.raters):
        items = [
            Trial(q, q.first if (swap + rater) % 2 == 0 else q.second)
            for q, swap in zip(questions, swapped, strict=True)
        ]
        items += _checks(used, methods, plan.checks, rng)
        order = rng.permutation(len(items))
        pages.append(Page(batch, tuple(items[k] for k in order)))
    return pages


def _balanced(questions: Sequence[Question], rng: np.random.Generator) -> list[int]:
    """0 or 1 for each question: as often one as the other among those on the same two methods."""
    swaps = [0] * len(questions)
    groups: dict[tuple[str, str], list[int]] = {}
    for k, q in enumerate(questions):
        groups.setdefault((q.first, q.second), []).append(k)
    for members in groups.values():
        start = int(rng.integers(2))
        for place, k in enumerate(rng.permutation(members).tolist()):
            swaps[k] = (start + place) % 2
    return swaps


def _checks(
    takes: Sequence[str], methods: Sequence[str], count: int, rng: np.random.Generator
) -> list[Trial]:
    """Films of one method against broken ones; half of them intact on the left."""
    sides = [SIDES[k % 2] for k in rng.permutation(count)]
    shown = [takes[int(rng.integers(len(takes)))] for _ in sides]
    by = [methods[int(rng.integers(len(methods)))] for _ in sides]
    return [
        Trial(Question(take, method, method), method, side)
        for take, method, side in zip(shown, by, sides, strict=True)
    ]
