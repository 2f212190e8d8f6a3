"""Suggest the format that an unknown folder resembles most, by the names of its files."""

import re
from collections.abc import Sequence
from difflib import SequenceMatcher

from ingest.formats.registry import Format

_ALIKE = 0.75
"""Least similarity (0 to 1) of two names that is worth a suggestion."""


def nearest(names: Sequence[str], formats: Sequence[Format]) -> Format | None:
    """Return the format whose expected file name is most similar to one of these names, or None.

    Args:
        names: names of the entries of the folder.
        formats: the formats to choose from.
    """
    best: tuple[float, Format | None] = (_ALIKE, None)
    for format_ in formats:
        for asked in re.findall(r"\w+\.\w{2,5}", format_.FILES):
            for name in names:
                alike = SequenceMatcher(None, asked.lower(), name.lower()).ratio()
                if alike > best[0]:
                    best = (alike, format_)
    return best[1]
