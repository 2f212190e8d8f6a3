"""Re-grasps: a hand that is on the object all the time, but goes from one place of it to another."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal import find_peaks

from omomo_core.contact.config import REGRASP
from omomo_core.contact.detour import length_of, path_between
from omomo_core.contact.segment import ContactSpan
from omomo_core.geometry.surface import Surface


def split_at_regrasps(
    span: ContactSpan,
    palm: Float[np.ndarray, "frames 3"],
    free: Bool[np.ndarray, " frames"],
    surface: Surface,
) -> tuple[ContactSpan, ...]:
    """Return the parts of a span between which the hand travels to another place, or the whole span.

    Args:
        span: one hand's contact; a segment's anchor stays with the first part.
        palm: that hand's predicted palm in the object's frame, metres.
        free: frames in which this hand may let go.
        surface: the object's, which the hand goes around.
    """
    first = max(span.start, 0)
    palm, free = palm[first : span.stop], free[first : span.stop]
    travels = [t for t in _travels(palm, surface) if free[slice(*t)].all()]
    while travels:
        moved = [_moved(palm, before, now, after) for before, now, after in _triples(travels, palm)]
        if min(moved) >= REGRASP.apart:
            break
        del travels[int(np.argmin(moved))]
    edges = [span.start, *(first + frame for t in travels for frame in t), span.stop]
    head, *others = zip(edges[::2], edges[1::2], strict=True)
    return (replace(span, stop=head[1]), *(ContactSpan(span.hand, *edge) for edge in others))


_Travel = tuple[int, int]
"""First frame on the way and first frame at the new place."""


def _travels(palm: Float[np.ndarray, "frames 3"], surface: Surface) -> list[_Travel]:
    """Return the travels between places: where the palm's place before differs most from that after."""
    if len(palm) < 2 * REGRASP.stay:
        return []
    places = np.median(sliding_window_view(palm, REGRASP.stay, axis=0), axis=-1)
    step = np.linalg.norm(places[REGRASP.stay :] - places[: -REGRASP.stay], axis=1)
    peaks, _ = find_peaks(np.pad(step, 1), height=REGRASP.apart, distance=REGRASP.stay)
    travels: list[_Travel] = []
    for at in peaks - 1:
        before, after = places[at], places[at + REGRASP.stay]
        near = palm[at : at + 2 * REGRASP.stay]
        # The change point of least absolute deviations: all before it near the one place, all
        # after it near the other.
        nearer = np.linalg.norm(near - before, axis=1) - np.linalg.norm(near - after, axis=1)
        sure = REGRASP.stay // 2
        change = int(at + sure + np.cumsum(nearer)[sure - 1 : -sure].argmin())
        length = length_of(path_between(before, after, surface))
        frames = int(np.clip(np.ceil(length / REGRASP.pace), REGRASP.quickest, REGRASP.slowest))
        travels.append((change - frames // 2, change - frames // 2 + frames))
    return travels


def _triples(
    travels: list[_Travel], palm: Float[np.ndarray, "frames 3"]
) -> list[tuple[_Travel, _Travel, _Travel]]:
    """Return each travel with the one before and the one after; the contact's ends count as travels."""
    all_of_it = [(0, 0), *travels, (len(palm), len(palm))]
    return [(a, b, c) for (a, b), (_, c) in pairwise(pairwise(all_of_it))]


def _moved(
    palm: Float[np.ndarray, "frames 3"], before: _Travel, now: _Travel, after: _Travel
) -> float:
    """Return the metres between the places before and after a travel; 0 where the palm does not stay."""
    sides = palm[before[1] : now[0]], palm[now[1] : after[0]]
    if min(len(side) for side in sides) < REGRASP.stay // 2:
        return 0.0
    return float(np.linalg.norm(np.median(sides[0], axis=0) - np.median(sides[1], axis=0)))
