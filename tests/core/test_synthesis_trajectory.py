"""Where a thing goes that is held, and when: it tilts away from whoever holds it, however it is turned."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.model import load_body
from omomo_core.learning.synthesis.action_plan import ActionPlan, PropPlacement
from omomo_core.learning.synthesis.actions import draw_action_plan
from omomo_core.learning.synthesis.base_motion import BaseMotion, ahead_of, left_of
from omomo_core.learning.synthesis.trajectory import both_come, holds_of, prop_trajectory

FACING = 0.7
FRAMES = 120
AHEAD, LEFT = ahead_of(np.array(FACING)), left_of(np.array(FACING))


def _standing() -> BaseMotion:
    root = np.tile([0.0, 0.0, 0.95], (FRAMES, 1))
    turn = np.array([[*LEFT, 0.0], [0.0, 0.0, 1.0], [*AHEAD, 0.0]]).T
    return BaseMotion(root, np.tile(turn, (FRAMES, 22, 1, 1)), np.zeros((FRAMES, 5)), [])


def _held(turn: float, pitch: float, rng: np.random.Generator) -> ActionPlan:
    """Something in the hands of somebody who stands, from the first frame to the last."""
    action_plan = draw_action_plan(rng, "in_place")
    assert action_plan is not None
    stance = PropPlacement(turn=turn, pitch=pitch)
    episode = replace(
        action_plan.episodes[0], takes=False, leaves=False, late=(0, 0), gesture=0.0, off=None,
        heights=(1.0,), stances=(stance, stance, stance), shove=None,
    )  # fmt: skip
    wanted = replace(action_plan.wanted, frames=FRAMES, pause_frames=[])
    return replace(action_plan, episodes=(episode,), wanted=wanted)


@pytest.mark.parametrize("turn", [-2.0, 0.0, 0.8, np.pi / 2, 3.0])
@pytest.mark.parametrize("pitch", [-0.6, 0.4])
def test_what_is_held_tilts_away_however_it_is_turned(turn: float, pitch: float) -> None:
    rng = np.random.default_rng(3)
    T = prop_trajectory(rng, load_body(), _standing(), _held(turn, pitch, rng)).T_world_prop
    top = T[:, :3, 2]
    away, aside = top[:, :2] @ AHEAD, top[:, :2] @ LEFT
    # Arms never hold a thing quite still.
    np.testing.assert_allclose(away, np.sin(pitch), atol=0.12)
    np.testing.assert_allclose(aside, 0.0, atol=0.12)


_ANY = _held(0.0, 0.0, np.random.default_rng(1))


@settings(max_examples=60)
@given(
    late=st.integers(0, 14), length=st.integers(1, 60), takes=st.booleans(), leaves=st.booleans()
)
def test_no_hand_leaves_before_it_comes(late: int, length: int, takes: bool, leaves: bool) -> None:
    episode = replace(_ANY.episodes[0], takes=takes, leaves=leaves, late=(late, 0), off=None)
    episode = replace(episode, hands=(True, True))
    span = (20, 20 + length)
    whole = all(hold.first < hold.last for hold in holds_of(episode, span))
    assert both_come(episode, span) == whole
