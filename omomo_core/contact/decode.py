"""Decoding of contact probabilities into segments: the likeliest path of both hands together (Viterbi)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from omomo_core.contact.anchor import anchor_spans
from omomo_core.contact.config import DECODING
from omomo_core.contact.regrasp import split_at_regrasps
from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import Surface
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion

HANDS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
"""The four states: which of left and right hand holds."""


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
) -> tuple[ContactSegment, ...]:
    """Decide which hand holds the object when, and where.

    Args:
        predicted: palms and contact probabilities of one sample, world, metres.
        surface: the object's surface in its own frame.
        T_world_object: the object's pose per frame.
        must_hold: frames in which at least one hand holds, however unlikely.
        prefix: segments of the first frames, which stay as they are; one that goes on keeps its
            anchor.

    Returns:
        Segments of both hands in the order in which they begin; those of one hand do not touch.
    """
    prefix = prefix.trimmed()
    palms = to_local(T_world_object, predicted.palms)
    holding = _viterbi(_costs(predicted.contact, palms, surface, must_hold, prefix))
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
