"""Who acts in a data set and what they handle, so that some people and objects can be held out."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from omomo_core.errors import InputError
from omomo_core.learning.recordings.splits import SEEN, UNSEEN
from omomo_core.learning.synthesis.people import STATURES
from omomo_core.learning.synthesis.props.catalogue import MAKERS

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
