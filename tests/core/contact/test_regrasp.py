"""Where a hand that stays on the object goes to another place of it, frame by frame."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from omomo_core.contact.decode import find_peaks, split_at_regrasps
from omomo_core.contact.segment import ContactSpan
from tests.core.contact.box import NOTHING

AT, STAYS = np.array([0.1, 0.2, 0.3]), 40


def steps(*stays: tuple[float, int]) -> np.ndarray:
    """A palm that is so many metres along x from AT, for so many frames, then at once elsewhere."""
    x = np.concatenate([np.full(frames, far) for far, frames in stays])
    return AT + x[:, None] * np.array([1.0, 0.0, 0.0])


def parts(palm: np.ndarray, start: int = 0) -> list[tuple[int, int]]:
    found = split_at_regrasps(
        ContactSpan(1, start, len(palm)), palm, np.ones(len(palm), bool), NOTHING
    )
    assert all(part.hand == 1 for part in found)
    return [(part.start, part.stop) for part in found]


@pytest.mark.parametrize(
    ("far", "before", "after"),
    [
        (0.11, 3, 3),
        (0.29, 3, 3),
        (0.31, 3, 4),
        (0.36, 4, 4),
        (0.52, 5, 6),
        (0.59, 6, 6),
        (0.9, 7, 8),
    ],
)
def test_a_hand_travels_at_walking_pace_for_six_to_twelve_frames(
    far: float, before: int, after: int
):
    """5 cm a frame, in the middle of which it is at the change."""
    found = parts(steps((0.0, STAYS), (far, STAYS)))
    assert found == [(0, STAYS - before), (STAYS + after, 2 * STAYS)]


def test_places_less_than_ten_centimetres_apart_are_one():
    assert len(parts(steps((0.0, STAYS), (0.105, STAYS)))) == 2
    assert len(parts(steps((0.0, STAYS), (0.095, STAYS)))) == 1


def test_a_contact_that_has_room_for_two_stays_of_twelve_frames_may_be_two():
    assert parts(steps((0.0, 12), (0.2, 12))) == [(0, 9), (15, 24)]
    assert len(parts(steps((0.0, 12), (0.2, 11)))) == 1


@pytest.mark.parametrize("start", [0, -4])
def test_a_hand_stays_six_frames_at_least_on_both_sides_of_a_travel(start: int):
    assert parts(steps((0.0, 9), (0.2, STAYS)), start) == [(start, 6), (12, 9 + STAYS)]
    assert len(parts(steps((0.0, 8), (0.2, STAYS)), start)) == 1
    assert parts(steps((0.0, STAYS), (0.2, 9)), start) == [(start, 37), (43, STAYS + 9)]
    assert len(parts(steps((0.0, STAYS), (0.2, 8)), start)) == 1


def test_of_two_travels_the_one_that_leads_nowhere_is_none():
    there_and_away = steps((0.0, STAYS), (0.29, 25), (0.44, 9), (0.29, STAYS))
    assert parts(there_and_away) == [(0, 37), (43, len(there_and_away))]
    before = steps((0.0, 25), (0.15, 9), (0.0, STAYS), (0.29, STAYS))
    assert parts(before) == [(0, 71), (77, len(before))]


def test_frames_astray_do_not_move_a_place():
    palm = steps((0.0, STAYS), (0.13, 2 * STAYS))
    palm[STAYS + 4 :: 3] = AT
    assert len(parts(palm)) == 2
    assert len(parts(palm[::-1])) == 2


def change_of(palm: np.ndarray) -> int:
    """The frame that best parts 12 frames about one place from 12 about another, six on each side.

    Among all stretches of 24 frames the one is taken whose places, medians, are farthest apart.
    """

    def apart(at: int) -> float:
        before, after = palm[at : at + 12], palm[at + 12 : at + 24]
        return float(np.linalg.norm(np.median(before, axis=0) - np.median(after, axis=0)))

    at = max(range(len(palm) - 23), key=apart)
    one, other = (np.median(palm[at + k : at + k + 12], axis=0) for k in (0, 12))

    def off(split: int) -> float:
        before, after = palm[at : at + split], palm[at + split : at + 24]
        return float(
            np.linalg.norm(before - one, axis=1).sum() + np.linalg.norm(after - other, axis=1).sum()
        )

    return at + min(range(6, 19), key=off)


def test_a_change_is_where_the_sums_of_distances_on_both_sides_are_least():
    """Amid noise and frames astray; the travel of a wide step is 15 frames about it."""
    seen = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        palm = steps((0.0, 26 + seed % 9), (0.95, 26)) + rng.normal(0, 0.08, (52 + seed % 9, 3))
        astray = rng.random(len(palm)) < 0.35
        astray[:18] = astray[-18:] = False
        palm[astray, 0] = AT[0] + rng.uniform(-0.2, 1.15, astray.sum())
        found = parts(palm)
        if len(found) == 2 and found[1][0] - found[0][1] == 15:
            seen += 1
            assert found[0][1] + 7 == change_of(palm), seed
    assert seen > 150


@pytest.mark.parametrize("frame", [37, 42])
def test_a_hand_does_not_travel_while_it_must_hold_for_a_frame(frame: int):
    palm = steps((0.0, STAYS), (0.29, STAYS))
    free = np.ones(len(palm), bool)
    free[[36, 43]] = False
    assert len(split_at_regrasps(ContactSpan(0, 0, len(palm)), palm, free, NOTHING)) == 2
    free[frame] = False
    assert split_at_regrasps(ContactSpan(0, 0, len(palm)), palm, free, NOTHING) == (
        ContactSpan(0, 0, len(palm)),
    )


@pytest.mark.parametrize("frames", [1, 5, 11])
def test_a_short_contact_is_one(frames: int):
    assert parts(steps((0.0, frames))) == [(0, frames)]


@given(heights=st.lists(st.integers(0, 6), min_size=3, max_size=40), distance=st.integers(1, 12))
def test_peaks_are_those_of_scipy(heights: list[int], distance: int):
    # Which of two equal peaks stays is a matter of the sort: no two are equal but along a plateau.
    x = np.repeat(np.array(heights) + 1e-3 * np.arange(len(heights)), 2)
    theirs, _ = signal.find_peaks(x, height=2.0, distance=distance)
    np.testing.assert_array_equal(find_peaks(x, 2.0, distance), theirs)
