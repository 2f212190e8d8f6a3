"""The paper's split: 15 people and ten objects to learn from, two people and five objects held out.

Clips of the OMOMO release and of our synthesis begin with who moves what (``sub16_woodchair_004``),
and so tell on which side they are.
"""

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

SEEN = (
    "largetable", "woodchair", "plasticbox", "largebox", "smallbox",
    "trashcan", "monitor", "floorlamp", "clothesstand", "vacuum",
)  # fmt: skip
UNSEEN = ("smalltable", "whitechair", "suitcase", "tripod", "mop")
TRAINING_PEOPLE = range(1, 16)
TEST_PEOPLE = range(16, 18)
Side = Literal["train", "seen", "unseen", "neither"]
"""To learn from; held-out people with objects that were learnt from; held-out people with held-out
objects; none of these."""
_NAME = re.compile(r"sub([1-9][0-9]*)_([a-z]+)(?:_|$)")


@dataclass(frozen=True)
class Cast:
    """Who moves what in a clip."""

    person: int
    object: str


def cast_of(name: str) -> Cast | None:
    """Who moves what, from the name of a clip; None where the name does not say it.

    Args:
        name: ``sub<number>_<object>_...``, as the release and our synthesis write it.
    """
    found = _NAME.match(name)
    return Cast(int(found[1]), found[2]) if found else None


def side_of(name: str, *, object_split: bool = True) -> Side:
    """On which side of the paper's split a clip is.

    Args:
        name: of the clip.
        object_split: the ten and the five objects are kept apart: training people with one of the
            five, and things that are none of the fifteen, are on neither side. Otherwise only people
            count, and nothing is "unseen".
    """
    cast = cast_of(name)
    if cast is None or not (cast.person in TRAINING_PEOPLE or cast.person in TEST_PEOPLE):
        return "neither"
    learns = cast.person in TRAINING_PEOPLE
    if not object_split or cast.object in SEEN:
        return "train" if learns else "seen"
    return "unseen" if cast.object in UNSEEN and not learns else "neither"


def by_side(names: Iterable[str], *, object_split: bool = True) -> dict[Side, list[str]]:
    """The names on each side, in their order; those that belong to neither form a group, too."""
    sides: defaultdict[Side, list[str]] = defaultdict(list)
    for name in names:
        sides[side_of(name, object_split=object_split)].append(name)
    return dict(sides)
