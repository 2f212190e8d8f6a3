"""From contact probabilities to contact segments, and to a better grip where a hold would fail."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from omomo_core.contact.contact_config import DECODING, REGRASP
from omomo_core.contact.segment import (
    ContactSegment,
    ContactSpan,
    anchor_spans,
    length_of,
    path_between,
)
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import Surface
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion


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
    if step.max() < REGRASP.apart:
        return []
    peaks = find_peaks(np.pad(step, 1), REGRASP.apart, REGRASP.stay)
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


def find_peaks(
    x: Float[np.ndarray, " n"], height: float, distance: int
) -> Int[np.ndarray, " peaks"]:
    """Return where local maxima of at least a height are; of some that are near each other, the highest.

    So does `scipy.signal`, which takes half a second to import.
    """
    changes = np.flatnonzero(np.diff(x))
    rises = x[changes + 1] > x[changes]
    tops = np.flatnonzero(rises[:-1] & ~rises[1:])
    peaks = (changes[tops] + 1 + changes[tops + 1]) // 2
    peaks = peaks[x[peaks] >= height]
    kept = np.ones(len(peaks), bool)
    for k in np.argsort(x[peaks])[::-1]:
        if kept[k]:
            kept &= np.abs(peaks - peaks[k]) >= distance
            kept[k] = True
    return peaks[kept]


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


HANDS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
"""The four states: which of left and right hand holds."""
HandChoice = Literal["one", "left", "right", "both"]
"""Which hands hold the object: one of them, the left or the right one of the person, or both together."""
_FORBIDDEN: dict[HandChoice, list[int]] = {
    "one": [3],
    "left": [2, 3],
    "right": [1, 3],
    "both": [1, 2],
}
"""States that such a choice leaves out."""


@dataclass(frozen=True)
class ContactPrefix:
    """Contact segments that are fixed in the first frames."""

    frames: int
    """How many first frames are fixed."""
    segments: Sequence[ContactSegment]
    """Those that begin in these frames count. One that stops at their end or later is still held until it is
    seen to end."""

    def trimmed(self) -> "ContactPrefix":
        """Return the prefix without segments that end before frame 0 or begin after it."""
        seen = [s for s in self.segments if s.start < self.frames and s.stop > 0]
        return ContactPrefix(self.frames, seen)


NO_PREFIX = ContactPrefix(0, ())
"""No contact is fixed."""


def decode(
    predicted: HandMotion,
    surface: Surface,
    T_world_object: Float[np.ndarray, "frames 4 4"],
    must_hold: Bool[np.ndarray, " frames"],
    prefix: ContactPrefix = NO_PREFIX,
    hands: HandChoice | None = None,
) -> tuple[ContactSegment, ...]:
    """Decide which hand holds the object when, and where.

    Args:
        predicted: palms and contact probabilities of one sample, world, metres.
        surface: the object's surface in its own frame.
        T_world_object: the object's pose per frame.
        must_hold: frames in which at least one hand holds, however unlikely.
        prefix: segments of the first frames, which stay as they are; one that goes on keeps its
            anchor.
        hands: which hands may hold, after the prefix; None for any.

    Returns:
        Segments of both hands in the order in which they begin; those of one hand do not touch.
    """
    prefix = prefix.trimmed()
    palms = to_local(T_world_object, predicted.palms)
    costs = _costs(predicted.contact, palms, surface, must_hold, prefix)
    if hands is not None:
        costs[prefix.frames :, _FORBIDDEN[hands]] = np.inf
    holding = _viterbi(costs)
    spans: list[ContactSpan] = []
    for hand in range(2):
        free = ~must_hold | holding[:, 1 - hand]
        free[: prefix.frames] = False
        for span in _spans(holding[:, hand], hand, prefix):
            parts = split_at_regrasps(span, palms[:, hand], free, surface)
            for before, after in pairwise(parts):
                holding[before.stop : after.start, hand] = False
            spans.extend(parts)
    spans.sort(key=lambda span: span.start)
    return anchor_spans(spans, predicted, surface, T_world_object)


def _costs(
    contact: Float[np.ndarray, "frames 2"],
    palms: Float[np.ndarray, "frames 2 3"],
    surface: Surface,
    must_hold: Bool[np.ndarray, " frames"],
    prefix: ContactPrefix,
) -> Float[np.ndarray, "frames 4"]:
    """Return the cost of each state in each frame, in log odds."""
    least = 1 / (1 + np.exp(DECODING.certain))
    p = contact.clip(least, 1 - least)
    distance, _ = surface.tree.query(palms)
    hold = np.log(1 - p) - np.log(p) + DECODING.distance * distance
    for s in prefix.segments:
        if s.stop < prefix.frames:  # a hand that has just let go is on its way
            hold[prefix.frames : s.stop + DECODING.shortest, s.hand] += 2 * DECODING.certain
    costs = hold @ HANDS.T
    costs[must_hold, 0] += DECODING.unheld
    held = np.zeros((prefix.frames, 2), int)
    for s in prefix.segments:
        held[max(s.start, 0) : s.stop, s.hand] = 1
    costs[: prefix.frames][(held[:, None] != HANDS).any(axis=-1)] = np.inf
    return costs


def _viterbi(costs: Float[np.ndarray, "frames 4"]) -> Bool[np.ndarray, "frames 2"]:
    """Return which hands hold in each frame of the cheapest path (Viterbi)."""
    changes = DECODING.change * np.abs(HANDS[:, None] - HANDS).sum(axis=-1)
    best, total = np.zeros(costs.shape, int), costs[0]
    for frame in range(1, len(costs)):
        ways = total[:, None] + changes
        best[frame] = ways.argmin(axis=0)
        total = ways.min(axis=0) + costs[frame]
    return HANDS[_backtrack(best, int(total.argmin()))] > 0


def _backtrack(best: Int[np.ndarray, "frames 4"], last: int) -> Int[np.ndarray, " frames"]:
    """Return the path that ends in a state, from the best predecessor of every state."""
    course = np.empty(len(best), int)
    for frame in range(len(best) - 1, -1, -1):
        course[frame] = last
        last = int(best[frame, last])
    return course


def _spans(
    holding: Bool[np.ndarray, " frames"], hand: int, prefix: ContactPrefix
) -> list[ContactSpan]:
    """Return one hand's spans; those of the prefix are kept."""
    kept: list[ContactSpan] = [s for s in prefix.segments if s.hand == hand]
    found = [ContactSpan(hand, a, b) for a, b in runs(holding)]
    still = [s for s in kept if s.stop >= prefix.frames]
    ended = [s for s in kept if s.stop < prefix.frames]
    gone_on = [run.stop for run in found if run.start < prefix.frames <= run.stop]
    return [
        *ended,
        *(replace(s, stop=stop) for s, stop in zip(still, gone_on, strict=True)),
        *(run for run in found if run.start >= prefix.frames),
    ]
