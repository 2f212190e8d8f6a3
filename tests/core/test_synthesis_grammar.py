"""Scripts of all actions, people of all statures, and hands that follow their holds."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.learning.synthesis.action_plan import Action
from omomo_core.learning.synthesis.actions import draw_action, draw_action_plan, draw_grasp
from omomo_core.learning.synthesis.base_motion import about_z
from omomo_core.learning.synthesis.holds import Handling, Hold
from omomo_core.learning.synthesis.palms_on_prop import PALM_THICKNESS, plan_hands
from omomo_core.learning.synthesis.props import Stock, make_prop
from omomo_core.learning.synthesis.synthesis_engine import classes_of

HANDLED: list[Action] = ["carry", "relocate", "in_place", "raise", "one_hand", "swing", "flip", "push",
                         "pull", "drag", "shove", "turn", "tip", "reach_over", "pivot"]  # fmt: skip


@pytest.mark.parametrize("action", HANDLED)
def test_every_action_has_scripts_that_fit_their_clips(action: Action) -> None:
    rng = np.random.default_rng(3)
    for _ in range(3):
        action_plan = draw_action_plan(rng, action)
        assert action_plan is not None
        wanted = action_plan.wanted
        assert 120 <= wanted.frames <= 300
        assert sum(wanted.pause_frames) <= wanted.frames
        ends = np.cumsum(wanted.pause_frames)
        pauses = [(int(b - a), int(b)) for a, b in zip(wanted.pause_frames, ends, strict=True)]
        spans = action_plan.spans(pauses)
        for (_, before), (after, _) in pairwise(spans):
            assert before < after
        for episode, (first, last) in zip(action_plan.episodes, spans, strict=True):
            assert 0 <= first < last <= wanted.frames
            assert any(episode.hands)
        assert all(e.takes for e in action_plan.episodes[1:])
        assert all(e.leaves for e in action_plan.episodes[:-1])


def test_what_offers_it_is_sometimes_lifted_with_one_hand() -> None:
    rng = np.random.default_rng(2)
    lifts = [
        draw_action_plan(rng, "relocate", 1.0, Stock(frozenset({"woodchair"}))) for _ in range(60)
    ]
    one = [sum(s.episodes[0].hands) == 1 for s in lifts if s is not None]
    assert 0.15 < np.mean(one) < 0.55


def test_what_is_raised_overhead_is_in_balance_and_clear_of_the_chest() -> None:
    rng = np.random.default_rng(6)
    turned = []
    for _ in range(60):
        action_plan = draw_action_plan(rng, "raise")
        assert action_plan is not None
        prop, (episode,) = action_plan.prop, action_plan.episodes
        left, right = episode.grasp.points
        palm = (left + right) / 2
        assert max(episode.heights) + palm[2] >= 1.55
        middle = (prop.low[0] + prop.high[0]) / 2
        assert all(episode.hands)
        assert prop.mass * abs(palm[0] - middle) < 1.2
        over = episode.stances[1].pitch < -0.9
        turned.append(over)
        assert over or palm[2] < 0.45
    assert 0.3 < np.mean(turned) < 0.95


def test_many_hold_before_they_stand_and_walk_off_before_they_have_let_go() -> None:
    rng = np.random.default_rng(4)
    early, late = [], []
    for _ in range(60):
        action_plan = draw_action_plan(rng, "carry")
        assert action_plan is not None
        episode, pauses = action_plan.episodes[0], action_plan.wanted.pause_frames
        starts = np.cumsum([60, *(p + 60 for p in pauses)])[:-1]
        stops = [(int(a), int(a + p)) for a, p in zip(starts, pauses, strict=True)]
        first, last = action_plan.spans(stops)[0]
        if episode.takes:
            early.append(first < stops[0][0])
        if episode.leaves:
            late.append(last > stops[-1][1])
    assert 0.3 < np.mean(early) < 0.9
    assert 0.3 < np.mean(late) < 0.9


def test_who_reaches_over_a_thing_has_one_hand_near_and_one_far_and_stoops() -> None:
    rng, farther = np.random.default_rng(8), []
    for _ in range(20):
        action_plan = draw_action_plan(rng, "reach_over")
        assert action_plan is not None
        assert action_plan.posture.squat < 0.5
        for episode in action_plan.episodes:
            R = about_z(np.array(episode.stances[1].turn))
            left, right = episode.grasp.points @ R.T
            assert abs(left[0] - right[0]) > 0.1
            assert np.linalg.norm(left - right) < 0.75
            assert episode.stances[1].pitch <= 0
            farther.append(left[0] > right[0])
    assert 0 < np.mean(farther) < 1


def test_chairs_that_go_high_are_often_held_low() -> None:
    rng = np.random.default_rng(9)
    chairs = [make_prop(rng, "lift", Stock(frozenset({"woodchair"}))) for _ in range(40)]
    low, standing = (
        np.mean([draw_grasp(rng, c, "lift", low)[0].points[:, 2].min() for c in chairs])
        for low in (1.0, 0.0)
    )
    assert low < 0.5 < standing


def test_all_actions_are_drawn() -> None:
    rng = np.random.default_rng(0)
    assert set(HANDLED) <= {draw_action(rng) for _ in range(2000)}


def test_one_seed_writes_one_script() -> None:
    first, second = (draw_action_plan(np.random.default_rng(5), "carry") for _ in range(2))
    assert first is not None
    assert second is not None
    assert first.wanted == second.wanted
    assert first.episodes[0].heights == second.episodes[0].heights


@pytest.mark.parametrize(
    ("objects", "never"), [("seen", "mop"), ("unseen", "vacuum"), ("monitor", "tip")]
)
def test_only_what_there_is_is_handled(objects: str, never: Action) -> None:
    stock, rng = Stock(classes_of(objects)), np.random.default_rng(1)
    actions = {draw_action(rng, stock) for _ in range(500)}
    assert actions
    assert never not in actions
    scripts = [draw_action_plan(rng, a, 1.0, stock) for a in sorted(actions) if a in HANDLED]
    handled = {action_plan.prop.name for action_plan in scripts if action_plan is not None}
    assert handled
    assert handled <= (stock.classes or set())


def test_what_nothing_can_be_used_for_is_given_up() -> None:
    mop = Stock(frozenset({"mop"}))
    assert draw_action_plan(np.random.default_rng(0), "relocate", 1.0, mop) is None


@settings(max_examples=25)
@given(gap=st.integers(2, 80), hand=st.sampled_from([0, 1]))
def test_a_hand_goes_from_hold_to_hold_without_a_jump(gap: int, hand: int) -> None:
    place = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    a, b = np.array([0.1, 0.2, 0.3]), np.array([0.2, 0.2, 0.1])
    holds = (
        Hold(hand, 20, 60, a, *place, reach=10, release=10),
        Hold(hand, 60 + gap, 180, b, *place, reach=10),
    )
    hands = plan_hands(Handling(np.tile(np.eye(4), (180, 1, 1)), holds))
    held = hands.contact[:, hand] > 0
    np.testing.assert_array_equal(np.flatnonzero(held), [*range(20, 60), *range(60 + gap, 180)])
    assert hands.contact[:, 1 - hand].sum() == hands.pull[:, 1 - hand].sum() == 0.0
    off = np.array([0.0, PALM_THICKNESS, 0.0])
    np.testing.assert_allclose(hands.palms[20:60, hand], np.tile(a + off, (40, 1)), atol=1e-9)
    np.testing.assert_allclose(hands.palms[60 + gap, hand], b + off, atol=1e-9)
    assert (hands.pull[held, hand] == 1.0).all()
    assert hands.pull[0, hand] == 0.0
    # Where the goal jumps, nothing pulls toward it.
    jumps = np.linalg.norm(np.diff(hands.palms[:, hand], axis=0), axis=-1) > 0.2
    assert hands.pull[:-1, hand][jumps].max(initial=0.0) < 1e-6
