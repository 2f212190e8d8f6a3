"""Finding: the result of a quick check of what was recorded in one step."""

from typing import NamedTuple


class Finding(NamedTuple):
    """Data that can be used; what cannot be used is an InputError instead."""

    good: str
    """What it is, in one line."""
    doubts: tuple[str, ...] = ()
    """What may spoil the result, each with how to do it better: the person decides."""
    notes: tuple[str, ...] = ()
    """What is worth knowing."""


def both(first: Finding, second: Finding) -> Finding:
    """Return two findings about the same recording joined into one."""
    return Finding(
        f"{first.good}, {second.good}", first.doubts + second.doubts, first.notes + second.notes
    )
