"""What stays on the floor goes the way people push and pull, and the side that is held rises."""

import numpy as np
import pytest

from omomo_core.learning.synthesis.action_plan import Action, tilt_for, way_of
from omomo_core.learning.synthesis.actions import draw_action_plan
from omomo_core.learning.synthesis.base_motion import BaseMotion, ahead_of, goes_its_way, left_of
from omomo_core.learning.synthesis.props import make_prop

FACING = 0.7


def _walk(direction: float, frames: int = 60) -> BaseMotion:
    """A body that faces one way and moves along `direction` from its heading."""
    root = np.zeros((frames, 3))
    root[:, :2] = np.linspace(0, 1, frames)[:, None] * ahead_of(np.array(FACING + direction))
    ahead, left = ahead_of(np.array(FACING)), left_of(np.array(FACING))
    turn = np.array([[*left, 0.0], [0.0, 0.0, 1.0], [*ahead, 0.0]]).T
    return BaseMotion(root, np.tile(turn, (frames, 22, 1, 1)), np.zeros((frames, 5)), [])


@pytest.mark.parametrize(
    ("direction", "ahead", "back"), [(0.0, True, False), (np.pi, False, True), (1.5, False, False)]
)
def test_only_walks_along_the_way_suit(direction: float, ahead: bool, back: bool):
    base_motion, whole = _walk(direction), [(5, 55)]
    assert goes_its_way(base_motion, whole, 1) == ahead
    assert goes_its_way(base_motion, whole, -1) == back
    assert goes_its_way(base_motion, whole, 0)


def test_most_pushes_lead_ahead_and_most_pulls_back():
    rng = np.random.default_rng(0)
    for action, way, least in (("push", 1, 0.53), ("pull", -1, 0.8), ("drag", -1, 0.55)):
        ways = [way_of(rng, action) for _ in range(400)]  # pyright: ignore[reportArgumentType]
        assert set(ways) == {way, 0}
        assert least < np.mean(np.array(ways) == way) < least + 0.15
    assert {way_of(rng, "carry") for _ in range(50)} == {0}


@pytest.mark.parametrize("action", ["push", "pull", "drag", "tip"])
def test_a_low_wide_thing_rises_where_it_is_held(action: Action):
    rng = np.random.default_rng(1)
    prop = make_prop(rng, "push")
    depth = float(prop.high[0] - prop.low[0])
    low = np.array([tilt_for(rng, action, prop, 0.9 * depth) for _ in range(300)])
    tall = np.array([tilt_for(rng, action, prop, 1.1 * depth) for _ in range(300)])
    assert (low >= 0).all()
    assert (low > 0).any()
    # A chair is tipped towards whoever pulls it by its back, but pushed over its far legs.
    assert (tall < 0).any() == (action != "push")


def test_scripts_of_pulls_ask_for_walks_that_lead_back():
    rng = np.random.default_rng(2)
    scripts = [draw_action_plan(rng, "pull") for _ in range(20)]
    ways = [action_plan.wanted.way for action_plan in scripts if action_plan is not None]
    assert -1 in ways
    assert 1 not in ways


def test_who_swings_a_thing_round_uses_one_hand_and_sets_it_down_level():
    rng = np.random.default_rng(5)
    for _ in range(20):
        action_plan = draw_action_plan(rng, "pivot")
        assert action_plan is not None
        for episode in action_plan.episodes:
            assert sum(episode.hands) == 1
            assert episode.still
            assert episode.shove is not None
            assert abs(episode.shove.yaw) >= 0.8
            assert episode.shove.pitch == 0.0
            assert 0.0 < abs(episode.shove.tilt) < 0.7
