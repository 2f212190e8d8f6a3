"""The design of a study: methods, takes, pairs, pages, attention checks."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np

from capture_app.manifest import MANIFEST
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
    """A question: which of two methods' films of a take is better."""

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
    """The trials that one rater sees, in order."""

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
            field="pairs",
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
    """Return questions in the order of the methods' pairs, so that batches get equal shares of each."""
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


@dataclass(frozen=True)
class Method:
    """A method's motions."""

    name: str
    takes: dict[str, Path]
    """Result folder, or npz file of a recorded clip, of each take by its name."""


def read_methods(folders: Sequence[Path]) -> list[Method]:
    """Return what is in the methods' folders; each method is called as its folder.

    Raises:
        InputError: fewer than two, one without a motion, two of one name, or no take in common.
    """
    methods = [_method(folder) for folder in folders]
    names = [m.name for m in methods]
    if len(methods) < 2 or len(set(names)) < len(names):
        raise InputError(
            "study-methods",
            "A study needs two or more methods whose folders have different names.",
            where=", ".join(map(str, folders)),
            fix="Give a folder for each method; rename those that are called the same.",
        )
    if not common_takes(methods):
        few = "; ".join(f"{m.name}: {', '.join(list(m.takes)[:3])}..." for m in methods)
        raise InputError(
            "study-no-common-take",
            "No take is in the folders of all methods.",
            where=few,
            fix="Name the results of one take the same in each folder.",
        )
    return methods


def common_takes(methods: Sequence[Method]) -> list[str]:
    """Names of the takes that every method has, sorted."""
    return sorted(set.intersection(*(set(m.takes) for m in methods)))


def _method(folder: Path) -> Method:
    inside = sorted(folder.iterdir()) if folder.is_dir() else []
    results = {p.name: p for p in inside if (p / MANIFEST).is_file()}
    clips = {p.stem: p for p in inside if p.suffix == ".npz" and p.is_file()}
    if not results and not clips:
        raise InputError(
            "study-no-motions",
            "There is no result and no recorded clip in this folder.",
            where=str(folder),
            fix="Give a folder that holds the result folders of one method.",
        )
    return Method(folder.resolve().name, {**clips, **results})
