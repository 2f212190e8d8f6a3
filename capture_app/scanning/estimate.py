"""estimate_seconds: about how long a scan will take, said before it starts."""

import os

from ingest.scan.scan_types import DRAFT_PICTURES

_START, _PICTURE = 50.0, 3.0
"""Seconds of a scan in which only one core works, and of all cores together for each of its pictures
(docs/scan.md has what was measured)."""
_DRAFT_START, _DRAFT = 20.0, 2.2
"""The same of a draft."""
_CORES = 4
"""More do not help much."""


def estimate_seconds(frames: int, draft: bool) -> float:
    """Seconds that a film takes on this machine when nothing else runs on it.

    Args:
        frames: pictures that it may use.
        draft: whether only a coarse mesh is made.
    """
    cores = min(_CORES, os.cpu_count() or 1)
    if draft:
        return _DRAFT_START + _DRAFT * min(frames, DRAFT_PICTURES) / cores
    return _START + _PICTURE * frames / cores


def in_words(seconds: float) -> str:
    """A length of time for people."""
    return (
        f"{10 * max(1, round(seconds / 10))} s" if seconds < 100 else f"{round(seconds / 60)} min"
    )
