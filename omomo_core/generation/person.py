"""One generated person: motion, contact segments and what could not be satisfied."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int

from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.motion import HumanMotion


@dataclass(frozen=True)
class FingerFit:
    """How the fingers of both hands (left, right) lie on the object."""

    depth: Float[np.ndarray, "frames 2"]
    """Depth of the deepest finger or palm in the object, metres."""
    pad_distance: Float[np.ndarray, "frames 2"]
    """Distance from the surface to the third nearest fingertip of a hand that holds, metres; else 0."""
    grip: Int[np.ndarray, "frames 2"]
    """Number of each hand's grip in `GRIPS`; 0 where it is free."""


@dataclass(frozen=True)
class Person:
    """A sample, or a stretch of frames of one."""

    human: HumanMotion
    segments: tuple[ContactSegment, ...]
    """What each hand holds and when; empty where palms are given or follow the published rule."""
    miss: Float[np.ndarray, "frames 2"]
    """Distance of each palm from its target where it should hold, metres; 0 elsewhere."""
    depth: Float[np.ndarray, " frames"]
    """Penetration depth of trunk, arms and legs, metres."""
    finger_fit: FingerFit | None = None
    """None where it was not measured."""


def stretch(person: Person, start: int, stop: int) -> Person:
    """Return frames `start` .. `stop` of a person; segments are cut to them."""
    human = HumanMotion(
        **{f.name: getattr(person.human, f.name)[start:stop] for f in fields(HumanMotion)}
    )
    return Person(
        human,
        shift_spans(person.segments, start, stop),
        person.miss[start:stop],
        person.depth[start:stop],
        None
        if person.finger_fit is None
        else FingerFit(
            **{f.name: getattr(person.finger_fit, f.name)[start:stop] for f in fields(FingerFit)}
        ),
    )


_S = TypeVar("_S", bound=ContactSpan)


def shift_spans(segments: Sequence[_S], start: int, stop: int) -> tuple[_S, ...]:
    """Return spans counted from frame `start` and cut to `start` .. `stop`."""
    cut = [
        replace(s, start=max(s.start, start) - start, stop=min(s.stop, stop) - start)
        for s in segments
    ]
    return tuple(s for s in cut if s.start < s.stop)


def join(parts: Sequence[Person]) -> Person:
    """Return consecutive stretches as one person; a segment that was cut between two is one again."""
    human = HumanMotion(
        **{
            f.name: np.concatenate([getattr(p.human, f.name) for p in parts])
            for f in fields(HumanMotion)
        }
    )
    segments: list[ContactSegment] = []
    first = 0
    for part in parts:
        for s in part.segments:
            _append(segments, replace(s, start=s.start + first, stop=s.stop + first))
        first += len(part.miss)
    return Person(
        human,
        tuple(sorted(segments, key=lambda s: (s.start, s.hand))),
        np.concatenate([p.miss for p in parts]),
        np.concatenate([p.depth for p in parts]),
        _joined_fit([p.finger_fit for p in parts]),
    )


def _joined_fit(parts: Sequence[FingerFit | None]) -> FingerFit | None:
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    return FingerFit(
        **{f.name: np.concatenate([getattr(p, f.name) for p in known]) for f in fields(FingerFit)}
    )


def _append(segments: list[ContactSegment], new: ContactSegment) -> None:
    for k, old in enumerate(segments):
        same = old.hand == new.hand and old.stop == new.start
        if same and np.array_equal(old.anchor, new.anchor):
            segments[k] = replace(old, stop=new.stop)
            return
    segments.append(new)
