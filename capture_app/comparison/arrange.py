"""From motions of different files to contenders on one clock in one world, with their numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from capture_app.comparison.align import Placement, place, same_object
from capture_app.comparison.motion import Motion, moved, stretch
from capture_app.comparison.numbers import Figures, figures_against, own_figures, shown
from omomo_core.errors import InputError
from omomo_core.motion import FPS
from render.comparison import Contender
from render.strips import Held

_SHORTEST = 4
"""Frames in common that a distance from the truth needs."""


@dataclass(frozen=True)
class PlacedMotion:
    """A motion in the first one's world, and where it stands on the common clock."""

    motion: Motion
    placement: Placement


@dataclass(frozen=True)
class Comparison:
    """What is drawn, and what is said about it."""

    contenders: tuple[Contender, ...]
    figures: tuple[Figures, ...]
    """Of each contender: see `capture_app.comparison.numbers.MEASURES`."""
    notes: tuple[str, ...]
    """How lengths, clocks and places were made to fit, in sentences."""


def placed_motions(motions: Sequence[Motion], *, any_object: bool = False) -> list[PlacedMotion]:
    """Each motion moved into the world of the first.

    Args:
        motions: two or more.
        any_object: allow other objects than the first one's.

    Raises:
        InputError: fewer than two, or another object.
    """
    if len(motions) < 2:
        raise InputError(
            "one-motion",
            "There is nothing to compare this motion with.",
            where=motions[0].label if motions else "",
            fix="Name a second one, or add --samples or --rule paper.",
        )
    first = motions[0]
    for other in motions[1:]:
        ours, theirs = first.object_motion.mesh, other.object_motion.mesh
        if not any_object and not same_object(ours, theirs):
            raise InputError(
                "objects-differ",
                f"{other.label} moves another object ({theirs.name}) than {first.label} "
                f"({ours.name}).",
                where=other.label,
                fix="Compare motions of one object, or add --any.",
            )
    alone = PlacedMotion(first, Placement(0, np.eye(4), 0.0, same_take=True))
    return [alone, *(_placed(first, other) for other in motions[1:])]


def compared(
    motions: Sequence[Motion],
    *,
    any_object: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> Comparison:
    """Motions placed, measured and described; the first truth is what the others are measured by.

    Raises:
        InputError: see `placed_motions`.
    """
    placed = placed_motions(motions, any_object=any_object)
    truth = next((p for p in placed if p.motion.truth), None)
    figures: list[Figures] = []
    for k, one in enumerate(placed):
        figures.append({**own_figures(one.motion), **_against(one, truth)})
        progress((k + 1) / len(placed))
    start = min(p.placement.begin for p in placed)
    contenders = tuple(
        Contender(
            p.motion.label,
            p.motion.human,
            p.motion.object_motion,
            p.motion.body,
            p.motion.contact,
            p.placement.begin - start,
            p.motion.truth,
            _reference(p, truth, start),
            numbers,
        )
        for p, numbers in zip(placed, shown(figures), strict=True)
    )
    notes = tuple(note for p in placed[1:] for note in _notes(placed[0], p))
    return Comparison(contenders, tuple(figures), notes)


def _placed(first: Motion, other: Motion) -> PlacedMotion:
    placement = place(first.object_motion, other.object_motion)
    return PlacedMotion(moved(other, placement.T), placement)


def _comparable(one: PlacedMotion, truth: PlacedMotion) -> bool:
    """Whether a motion is of the truth's take, and another one."""
    return one is not truth and one.placement.same_take and truth.placement.same_take


def _reference(one: PlacedMotion, truth: PlacedMotion | None, start: int) -> Held | None:
    if truth is None or not _comparable(one, truth):
        return None
    return Held(truth.motion.contact, truth.placement.begin - start)


def _against(one: PlacedMotion, truth: PlacedMotion | None) -> Figures:
    """Nothing where there is no truth, or too little of it."""
    if truth is None or not _comparable(one, truth):
        return {}
    start = max(p.placement.begin for p in (one, truth))
    stop = min(p.placement.begin + len(p.motion.human.root) for p in (one, truth))
    if stop - start < _SHORTEST:
        return {}
    ours, theirs = (
        stretch(p.motion, start - p.placement.begin, stop - p.placement.begin) for p in (one, truth)
    )
    return figures_against(ours, theirs)


def _notes(first: PlacedMotion, other: PlacedMotion) -> list[str]:
    a, b, at = first.motion.label, other.motion.label, other.placement
    if not at.same_take:
        return [
            f"{b}: the object goes another way than in {a}. Both begin together, where the object "
            f"stands in {a}; distances between them mean little.",
            *_ends(first, other),
        ]
    notes: list[str] = []
    if not np.array_equal(at.T, np.eye(4)):
        turn = np.rad2deg(np.arctan2(at.T[1, 0], at.T[0, 0]))
        notes.append(
            f"{b}: its world was turned by {turn:.1f} degrees and shifted by "
            f"{np.linalg.norm(at.T[:2, 3]):.2f} m, so that the object goes as in {a} "
            f"(within {100 * at.apart:.1f} cm)."
        )
    return [*notes, *_ends(first, other)]


def _ends(first: PlacedMotion, other: PlacedMotion) -> list[str]:
    """Where the two do not begin or end together."""
    a, b = first.motion.label, other.motion.label
    begin = other.placement.begin
    notes: list[str] = []
    if begin:
        late = "after" if begin > 0 else "before"
        notes.append(f"{b} begins {abs(begin) / FPS:.2f} s {late} {a}.")
    end = begin + len(other.motion.human.root) - len(first.motion.human.root)
    if end:
        late = "after" if end > 0 else "before"
        notes.append(
            f"{b} ends {abs(end) / FPS:.2f} s {late} {a}; who has ended stands still, faded."
        )
    return notes
