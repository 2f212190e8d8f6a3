"""Which format a folder that is none comes nearest to, by the names of files that it asks for."""

import re
from collections.abc import Sequence
from difflib import SequenceMatcher

from ingest.formats.registry import Format

_ALIKE = 0.75


def nearest(names: Sequence[str], formats: Sequence[Format]) -> Format | None:
    """The format one of whose file names is most like one of these; None where none is.

    Args:
        names: of the entries of a folder.
        formats: those to look among.
    """
    best: tuple[float, Format | None] = (_ALIKE, None)
    for format_ in formats:
        for asked in re.findall(r"\w+\.\w{2,5}", format_.FILES):
            for name in names:
                alike = SequenceMatcher(None, asked.lower(), name.lower()).ratio()
                if alike > best[0]:
                    best = (alike, format_)
    return best[1]
