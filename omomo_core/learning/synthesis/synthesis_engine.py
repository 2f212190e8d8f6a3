"""The synthesis engine: mocap in, clips of people who move things out, by a roster of people and objects."""

import re
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from omomo_core.body.model import BodyModel
from omomo_core.compute import worker_pool
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.splits import SEEN, UNSEEN
from omomo_core.learning.synthesis.actions import draw_action
from omomo_core.learning.synthesis.attempt import attempt, finished
from omomo_core.learning.synthesis.base_motion import survey
from omomo_core.learning.synthesis.base_motion_search import Sources
from omomo_core.learning.synthesis.props import Stock
from omomo_core.learning.synthesis.props.catalogue import MAKERS
from omomo_core.learning.synthesis.walker.improvise import index

_OURS = 1.72
STATURES = {
    1: 1.67, 2: 1.82, 3: 1.55, 4: 1.72, 5: 1.77, 6: 1.61, 7: 1.91, 8: 1.68, 9: 1.73,
    10: 1.58, 11: 1.85, 12: 1.70, 13: 1.49, 14: 1.75, 15: 1.65, 16: 1.63, 17: 1.79,
}  # fmt: skip
"""Metres: the 17 quantiles of adults of both sexes (mean 1.70, deviation 0.11), in no order."""


def our_scale(person: int) -> float:
    """Our stature over that of a person: props are scaled by it."""
    return _OURS / STATURES[person]


_EVERYBODY = tuple(STATURES)
_SPAN = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?")


@dataclass(frozen=True)
class Roster:
    """The people and classes of objects that clips are drawn from."""

    people: tuple[int, ...] = _EVERYBODY
    classes: frozenset[str] | None = None
    """Names of `MAKERS`; None for all."""

    @property
    def people_text(self) -> str:
        """The people, as `people_of` reads them."""
        starts = [p for p in self.people if p - 1 not in self.people]
        ends = [p for p in self.people if p + 1 not in self.people]
        pairs = zip(starts, ends, strict=True)
        return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in pairs)

    @property
    def objects_text(self) -> str:
        """The classes, as `classes_of` reads them."""
        return "all" if self.classes is None else ",".join(sorted(self.classes))


def people_of(text: str) -> tuple[int, ...]:
    """People from text like ``1-15`` or ``3,16-17``.

    Raises:
        InputError: ``unknown-people`` when it is not that, or one of them is not there.
    """
    chosen: set[int] = set()
    for part in text.split(","):
        span = _SPAN.fullmatch(part.strip())
        first, last = (int(span[1]), int(span[2] or span[1])) if span else (1, 0)
        if not (first <= last and first in STATURES and last in STATURES):
            raise InputError(
                "unknown-people",
                f"{part.strip()!r} names no people.",
                where="people",
                fix=f"Give numbers of 1 to {len(STATURES)}, like 1-15 or 3,16-17.",
            )
        chosen.update(range(first, last + 1))
    return tuple(sorted(chosen))


def classes_of(text: str) -> frozenset[str] | None:
    """Classes of objects from ``all``, ``seen`` and ``unseen`` (the paper's split), or their names.

    Raises:
        InputError: ``unknown-object`` when one of them is not there.
    """
    if text == "all":
        return None
    groups: dict[str, Sequence[str]] = {"seen": SEEN, "unseen": UNSEEN}
    classes: set[str] = set()
    for name in (part.strip() for part in text.split(",")):
        found = groups.get(name, [name] if name in MAKERS else [])
        if not found:
            raise InputError(
                "unknown-object",
                f"There is no class of objects {name!r}.",
                where="objects",
                fix=f"Give all, seen, unseen, or names of: {', '.join(sorted(MAKERS))}.",
            )
        classes.update(found)
    return frozenset(classes)


RECIPE = 15
"""Raised whenever the same seed makes other clips: data of two recipes must not be mixed unnoticed."""
EVERYTHING = Roster()
_TRIES = 60
"""Attempts at one action; then another is drawn."""
_MOST_TRIES = 600


def synthesise(
    clips: Sequence[Clip],
    body: BodyModel,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    *,
    workers: int = 1,
    rejected: Counter[str] | None = None,
    indices: Sequence[int] | None = None,
    roster: Roster = EVERYTHING,
) -> Generator[Clip]:
    """Make clips of people carrying, pushing, pulling, lifting and turning things.

    Args:
        clips: mocap on our skeleton, from `build_mocap`; clips with objects are left out.
        body: whose proportions the clips have.
        count: how many clips to make.
        seed: together with a clip's index it fixes the clip, whatever the number of workers.
        progress: called with clips done and clips in all.
        workers: processes to use.
        rejected: counts the attempts that were thrown away, by reason; up to date with every clip.
        indices: of the clips to make; 0 to `count` - 1 if not given.
        roster: who acts and what is handled.

    Returns:
        Clips of 120 to 300 frames with objects, source ``synthesis``, under the licence of their
        mocap, in the order of their indices; their names say who moves what (`splits.cast_of`).

    Raises:
        InputError: ``synthesis-footage`` when the mocap has no usable stretch.
    """
    wanted = range(count) if indices is None else indices
    footage = survey([_recorded(c) for c in clips if c.object_motion is None], body)
    if not footage.stretches:
        raise InputError(
            "synthesis-footage",
            "The mocap has no stretch of calm walking or standing of 1.5 s.",
            fix="Give more or longer clips.",
        )
    sources = Sources(footage, index(footage, body), Stock(roster.classes))
    make = partial(_clip, sources, roster.people, body, seed)
    if workers == 1:
        yield from _reported(map(make, wanted), len(wanted), progress, rejected)
        return
    with worker_pool(workers, _start_worker, make) as pool:
        yield from _reported(pool.map(_work, wanted), len(wanted), progress, rejected)


def _recorded(clip: Clip) -> Clip:
    """Rounded to single precision, computed in double: a clip in memory and in a file are one."""
    root, rotations = (x.astype(np.float32).astype(np.float64) for x in (clip.root, clip.rotations))
    return replace(clip, root=root, rotations=rotations)


def _reported(
    results: Iterable[tuple[Clip, Counter[str]]],
    count: int,
    progress: Callable[[int, int], None] | None,
    rejected: Counter[str] | None,
) -> Iterator[Clip]:
    for done, (clip, reasons) in enumerate(results, start=1):
        if rejected is not None:
            rejected.update(reasons)
        if progress is not None:
            progress(done, count)
        yield clip


_Maker = Callable[[int], tuple[Clip, Counter[str]]]
_maker: list[_Maker] = []
"""In a worker process: what makes a clip. The footage is sent once, not with every clip."""


def _start_worker(make: _Maker) -> None:
    _maker[:] = [make]


def _work(index: int) -> tuple[Clip, Counter[str]]:
    return _maker[0](index)


def _clip(
    sources: Sources, people: Sequence[int], body: BodyModel, seed: int, index: int
) -> tuple[Clip, Counter[str]]:
    """The clip of one index, and why earlier attempts at it failed."""
    rng = np.random.default_rng([seed, index])
    person = int(rng.choice(people))
    reasons: Counter[str] = Counter()
    while reasons.total() < _MOST_TRIES:
        action = draw_action(rng, sources.stock)
        for _ in range(_TRIES):
            take = attempt(rng, sources, body, action, our_scale(person))
            if not isinstance(take, str):
                return finished(rng, body, take, person, f"{seed}_{index:05d}"), reasons
            reasons[take] += 1
    raise InputError(
        "synthesis-footage",
        f"No clip came out of {reasons.total()} attempts; the mocap does not suit.",
        where=f"clip {index}",
        fix="Give more mocap of walking, turning and standing.",
    )
