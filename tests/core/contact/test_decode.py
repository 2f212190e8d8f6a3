"""Which hand holds when, from probabilities that flicker, are noisy or too low."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.contact.contact_config import DECODING, REGRASP
from omomo_core.contact.decode import ContactPrefix, decode
from omomo_core.contact.segment import ContactSegment, follow_anchors
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion
from tests.core.contact.box import FRAMES, LEFT, RIGHT, SURFACE, carried, hands, switched

NEVER, ALWAYS = np.zeros(FRAMES, bool), np.ones(FRAMES, bool)
TOP = np.array([0.1, 0.0, 0.23])


def times(segments: tuple[ContactSegment, ...]) -> list[tuple[int, int, int]]:
    return [(s.hand, s.start, s.stop) for s in segments]


def held(segments: tuple[ContactSegment, ...], frames: int = FRAMES) -> np.ndarray:
    return switched(frames, *[(s.hand, max(s.start, 0), s.stop) for s in segments]) > 0


@given(seed=st.integers(0, 10_000), most=st.floats(0.01, 1.0))
@settings(max_examples=60)
def test_an_object_that_must_be_held_is_never_unheld(seed: int, most: float):
    """Whatever the probabilities, and wherever the palms wander meanwhile."""
    rng = np.random.default_rng(seed)
    T = carried(seed)
    must = np.repeat(rng.random(FRAMES // 10) < 0.5, 10)
    where = rng.choice([-0.24, 0.24], (FRAMES // 15, 2)).repeat(15, axis=0)
    places = [np.stack([x, 0 * x, 0 * x], axis=1) for x in where.T]
    contact = most * rng.random((FRAMES // 9, 2)).repeat(9, axis=0)
    segments = decode(hands(T, contact, *places), SURFACE, T, must)
    assert held(segments)[must].any(axis=1).all()


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30)
def test_weak_probabilities_do_not_hold_what_may_rest(seed: int):
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    contact = 0.55 * np.random.default_rng(seed).random((FRAMES, 2))
    assert decode(hands(T, contact), SURFACE, T, NEVER) == ()


@given(
    first=st.integers(12, 40), length=st.integers(1, DECODING.shortest - 1), hand=st.integers(0, 1)
)
@settings(max_examples=30)
def test_flickers_vanish(first: int, length: int, hand: int):
    T = carried(first)
    flicker = slice(first, first + length)
    off, on = switched(FRAMES, (1 - hand, 0, FRAMES)), np.ones((FRAMES, 2))
    off[flicker, hand], on[flicker, hand] = 1.0, 0.0
    assert times(decode(hands(T, off), SURFACE, T, NEVER)) == [(1 - hand, 0, FRAMES)]
    both = [(0, 0, FRAMES), (1, 0, FRAMES)]
    assert times(decode(hands(T, on), SURFACE, T, NEVER)) == both


@given(seed=st.integers(0, 10_000), start=st.integers(15, 35), stop=st.integers(55, 75))
@settings(max_examples=60)
def test_begin_and_end_are_found_in_noise(seed: int, start: int, stop: int):
    T = carried(seed)
    noise = 0.1 * np.random.default_rng(seed).normal(size=(FRAMES, 2))
    truth = switched(FRAMES, (0, start, stop))
    contact = (0.2 + 0.6 * truth + noise).clip(0, 1)
    ((hand, begin, end),) = times(decode(hands(T, contact), SURFACE, T, NEVER))
    assert hand == 0
    assert abs(begin - start) <= 2
    assert abs(end - stop) <= 2


def test_the_likelier_hand_holds_and_of_equals_the_nearer():
    T = carried(3)
    contact = np.tile([0.05, 0.3], (FRAMES, 1))
    assert times(decode(hands(T, contact), SURFACE, T, ALWAYS)) == [(1, 0, FRAMES)]
    for far, hand in ((LEFT * 3, 1), (LEFT, 0)):
        predicted = hands(T, switched(FRAMES), far, RIGHT * 2)
        assert times(decode(predicted, SURFACE, T, ALWAYS)) == [(hand, 0, FRAMES)]


def goes(frame: int, there: np.ndarray, frames: int = FRAMES, travel: int = 6) -> np.ndarray:
    """The right palm, which goes to another place about a frame."""
    share = ((np.arange(frames) - frame) / travel + 0.5).clip(0, 1)[:, None]
    return RIGHT + share * (there - RIGHT)


@given(frame=st.integers(20, FRAMES - 20), travel=st.integers(1, 14), seed=st.integers(0, 1000))
@settings(max_examples=40)
def test_a_re_grasp_is_found_while_the_other_hand_holds(frame: int, travel: int, seed: int):
    T = carried(seed)
    noise = 0.01 * np.random.default_rng(seed).normal(size=(FRAMES, 3))
    predicted = hands(T, np.ones((FRAMES, 2)), LEFT, goes(frame, TOP, travel=travel) + noise)
    segments = decode(predicted, SURFACE, T, ALWAYS)
    before, after = (s for s in segments if s.hand == 1)
    assert abs((before.stop + after.start) / 2 - frame) < 5
    assert DECODING.shortest <= after.start - before.stop <= REGRASP.slowest
    assert np.linalg.norm(before.anchor - RIGHT) < 0.05
    assert np.linalg.norm(after.anchor - TOP) < 0.05


def test_the_only_hand_does_not_let_go_of_what_it_carries():
    T = carried(4)
    contact = switched(FRAMES, (1, 0, FRAMES))
    predicted = hands(T, contact, LEFT, goes(40, TOP))
    assert times(decode(predicted, SURFACE, T, ALWAYS)) == [(1, 0, FRAMES)]
    assert len(decode(predicted, SURFACE, T, NEVER)) == 2


def test_wavering_and_a_short_way_out_and_back_are_no_re_grasps():
    T = carried(5)
    t = np.arange(FRAMES)
    waver = RIGHT + 0.04 * np.sin(t / 5)[:, None] * np.array([0.0, 1.0, 0.0])
    slide = RIGHT + np.linspace(-0.12, 0.12, FRAMES)[:, None] * np.array([0.0, 1.0, 0.0])
    out = np.tile(RIGHT, (FRAMES, 1))
    out[40:49] = TOP
    for palm in (waver, slide, out):
        predicted = hands(T, np.ones((FRAMES, 2)), LEFT, palm)
        assert len(decode(predicted, SURFACE, T, ALWAYS)) == 2


def test_a_hand_goes_to_and_fro():
    frames = 300
    T = carried(6, frames)
    palm = np.tile(RIGHT, (frames, 1))
    palm[60:90] = palm[150:220] = TOP
    predicted = hands(T, np.ones((frames, 2)), LEFT, palm)
    right = [s for s in decode(predicted, SURFACE, T, np.ones(frames, bool)) if s.hand == 1]
    assert [bool(s.anchor[2] > 0.2) for s in right] == [False, True, False, True, False]


def part(predicted: HandMotion, first: int, last: int) -> HandMotion:
    return replace(
        predicted, palms=predicted.palms[first:last], contact=predicted.contact[first:last]
    )


def moved(segments: tuple[ContactSegment, ...], by: int) -> tuple[ContactSegment, ...]:
    return tuple(replace(s, start=s.start + by, stop=s.stop + by) for s in segments)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=40)
def test_two_chapters_agree_at_the_seam(seed: int):
    """The second chapter sees frames 60 on; up to 90 they are decided, by what sees up to 120."""
    frames, first, seen, until = 180, 60, 120, 90
    rng = np.random.default_rng(seed)
    T = carried(seed, frames)
    contact = (rng.random((frames // 12, 2)).repeat(12, axis=0) > 0.35) * 0.7 + 0.15
    palm = goes(int(rng.integers(70, 110)), TOP, frames) + 0.01 * rng.normal(size=(frames, 3))
    predicted = hands(T, contact + 0.05 * rng.normal(size=(frames, 2)), LEFT, palm)
    must = np.repeat(rng.random(frames // 20) < 0.5, 20)

    early = decode(part(predicted, 0, seen), SURFACE, T[:seen], must[:seen])
    decided = ContactPrefix(until - first, moved(early, -first))
    late = decode(part(predicted, first, frames), SURFACE, T[first:], must[first:], decided)
    late = moved(late, first)

    def before(
        segments: tuple[ContactSegment, ...],
    ) -> list[tuple[int, int, int, tuple[float, ...]]]:
        begun = [s for s in segments if s.start < until and s.stop > first]
        return sorted((s.hand, s.start, min(s.stop, until), tuple(s.anchor)) for s in begun)

    assert before(early) == before(late)
    whole = [s for s in early if s.stop <= first] + list(late)
    assert held(tuple(whole), frames)[must].any(axis=1).all()
    local = to_local(T, follow_anchors(whole, predicted, T, SURFACE).palms)
    for hand in range(2):
        mine = sorted((s for s in whole if s.hand == hand), key=lambda s: s.start)
        for s, after in pairwise(mine):
            assert after.start > s.stop
    assert np.linalg.norm(np.diff(local, axis=0), axis=-1).max() < 0.25


def test_a_hand_that_was_seen_to_let_go_stays_away_a_while():
    T = carried(7)
    before = ContactSegment(0, -30, 28, LEFT)
    decided = ContactPrefix(30, (before, ContactSegment(1, -60, -30, RIGHT)))
    segments = decode(hands(T, np.ones((FRAMES, 2))), SURFACE, T, NEVER, decided)
    assert times(segments) == [(0, -30, 28), (1, 30, FRAMES), (0, 34, FRAMES)]
    np.testing.assert_array_equal(segments[0].anchor, LEFT)


def test_a_hand_that_still_holds_keeps_its_anchor():
    T = carried(8)
    anchor = LEFT + np.array([0.0, 0.05, 0.0])
    contact = switched(FRAMES, (0, 0, 60))
    for stop in (30, 31, 500):
        decided = ContactPrefix(30, (ContactSegment(0, -5, stop, anchor),))
        (segment,) = decode(hands(T, contact), SURFACE, T, NEVER, decided)
        assert times((segment,)) == [(0, -5, 60)]
        np.testing.assert_array_equal(segment.anchor, anchor)


@pytest.mark.parametrize(("frames", "held_for"), [(5, 0), (7, 7)])
def test_a_certain_contact_of_seven_frames_is_one(frames: int, held_for: int):
    T = carried(9)
    contact = switched(FRAMES, (0, 40, 40 + frames))
    assert held(decode(hands(T, contact), SURFACE, T, NEVER)).sum() == held_for


@pytest.mark.parametrize(
    ("left", "farther", "hand"),
    [(0.06, 0.22, 0), (0.06, 0.28, 1), (0.04, 0.02, 1), (0.055, 0.02, 0)],
)
def test_a_metre_weighs_as_one_in_log_odds_and_nothing_is_surer_than_one_in_twenty(
    left: float, farther: float, hand: int
):
    """Log odds of 0.06 are 2.75, those of 0.055 2.84; those of 0.04 and 0.001 count as 3."""
    T = carried(10)
    contact = np.tile([left, 0.001], (FRAMES, 1))
    predicted = hands(T, contact, LEFT - [farther, 0.0, 0.0], RIGHT)
    assert times(decode(predicted, SURFACE, T, ALWAYS)) == [(hand, 0, FRAMES)]


def test_what_is_decided_holds_against_what_is_predicted_now():
    """A hold that began before the first frame goes on to its end, though nothing is predicted there."""
    T = carried(8)
    decided = ContactPrefix(30, (ContactSegment(0, -5, 25, LEFT),))
    segments = decode(hands(T, np.zeros((FRAMES, 2))), SURFACE, T, NEVER, decided)
    assert times(segments) == [(0, -5, 25)]
