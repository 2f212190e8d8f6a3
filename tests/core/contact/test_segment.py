"""Palms that keep to their anchors and go smoothly between them and the prediction."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.contact.contact_config import ANCHOR
from omomo_core.contact.segment import ContactSegment, follow_anchors
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion
from tests.core.contact.box import FRAMES, LEFT, NOTHING, RIGHT, SURFACE, carried, hands, switched

STEEPEST = 15 / 8
"""Of a minimum-jerk step over one frame."""


@st.composite
def holds(draw: st.DrawFn) -> list[ContactSegment]:
    """Segments of both hands, those of one hand at least six frames apart."""
    found: list[ContactSegment] = []
    for hand in range(2):
        frame = draw(st.integers(-20, 30))
        while frame < FRAMES:
            stop = frame + draw(st.integers(1, 40))
            anchor = np.array(draw(st.tuples(*[st.floats(-0.3, 0.3)] * 3)))
            found.append(ContactSegment(hand, frame, stop, anchor))
            frame = stop + draw(st.integers(6, 40))
    return found


@given(segments=holds(), seed=st.integers(0, 100))
@settings(max_examples=60)
def test_palms_are_on_their_anchors_and_nowhere_jump(segments: list[ContactSegment], seed: int):
    T = carried(seed)
    predicted = hands(T, switched(FRAMES))
    held = follow_anchors(segments, predicted, T, NOTHING)
    local = to_local(T, held.palms)
    for s in segments:
        span = slice(max(s.start, 0), max(s.stop, 0))
        assert np.abs(local[span, s.hand] - s.anchor).max(initial=0.0) < 1e-9
        assert (held.contact[span, s.hand] == 1).all()
    assert held.contact.min() >= 0
    assert held.contact.max() <= 1
    # From anchor to anchor in no less than seven frames, from the prediction in eight, or both.
    farthest = np.linalg.norm([0.6, 0.6, 0.6])
    speed = np.linalg.norm(np.diff(local, axis=0), axis=-1)
    assert speed.max() < STEEPEST * farthest * (1 / 7 + 1 / ANCHOR.blend)


@given(segments=holds(), seed=st.integers(0, 100))
@settings(max_examples=30)
def test_away_from_segments_palms_are_as_predicted(segments: list[ContactSegment], seed: int):
    T = carried(seed)
    predicted = hands(T, switched(FRAMES))
    held = follow_anchors(segments, predicted, T, NOTHING)
    near = np.zeros((FRAMES, 2), bool)
    for s in segments:
        near[max(s.start - ANCHOR.blend, 0) : max(s.stop + ANCHOR.blend, 0), s.hand] = True
    np.testing.assert_array_equal(held.palms[~near], predicted.palms[~near])
    assert (held.contact[~near] == 0).all()


def test_a_hand_that_soon_holds_again_goes_there_directly():
    T = carried(1)
    segments = [ContactSegment(0, 20, 40, LEFT), ContactSegment(0, 50, 70, RIGHT)]
    far = HandMotion(np.full((FRAMES, 2, 3), 9.0), switched(FRAMES))
    local = to_local(T, follow_anchors(segments, far, T, NOTHING).palms)[40:50, 0]
    way = (local - LEFT) @ (RIGHT - LEFT) / np.linalg.norm(RIGHT - LEFT) ** 2
    assert (np.diff(way) > 0).all()
    np.testing.assert_allclose(local, LEFT + way[:, None] * (RIGHT - LEFT), atol=1e-9)


def test_a_hand_that_soon_holds_another_face_goes_around_what_is_between():
    T = carried(1)
    segments = [ContactSegment(0, 20, 40, LEFT), ContactSegment(0, 55, 70, RIGHT)]
    far = HandMotion(np.full((FRAMES, 2, 3), 9.0), switched(FRAMES))
    local = to_local(T, follow_anchors(segments, far, T, SURFACE).palms)[39:56, 0]
    assert (np.abs(local[1:-1]).max(axis=1) > 0.22).all()
    assert np.linalg.norm(np.diff(local, axis=0), axis=1).max() < 0.13
    np.testing.assert_allclose(local[[0, -1]], [LEFT, RIGHT], atol=1e-9)


def test_a_palm_comes_to_its_place_within_eight_frames_and_is_half_there_after_four():
    T = carried(2)
    weight = follow_anchors(
        [ContactSegment(0, 30, 50, LEFT)], hands(T, switched(FRAMES)), T, NOTHING
    ).contact[:, 0]
    np.testing.assert_array_equal(weight[[22, 57]], 0.0)
    assert 0.0 < weight[23] < 0.02
    np.testing.assert_allclose(weight[[26, 53]], 0.5)
    np.testing.assert_array_equal(weight[30:50], 1.0)


def test_between_two_contacts_no_more_than_sixteen_frames_apart_a_palm_takes_no_detour():
    T = carried(1)
    far = HandMotion(np.full((FRAMES, 2, 3), 9.0), switched(FRAMES))
    for pause, direct in ((15, True), (16, False)):
        segments = [ContactSegment(0, 10, 30, LEFT), ContactSegment(0, 30 + pause, 80, RIGHT)]
        local = to_local(T, follow_anchors(segments, far, T, NOTHING).palms)[30 : 30 + pause, 0]
        assert (np.linalg.norm(local, axis=1).max() < 0.3) == direct
