"""Tools with a head or wheels on the floor: they stay on it, wheels roll, hands stay in place."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.model import BodyModel, load_body
from omomo_core.learning.synthesis.base_motion import BaseMotion
from omomo_core.learning.synthesis.cart_use import cart_trajectory, trolley_trajectory
from omomo_core.learning.synthesis.holds import Handling
from omomo_core.learning.synthesis.props.catalogue import MAKERS, placed
from omomo_core.learning.synthesis.tool_use import (
    PROPS,
    ToolAction,
    ToolUse,
    around,
    draw_tool_use,
    sole,
    stroke_trajectory,
)

FRAMES = 150
STROKES: list[ToolAction] = ["sweep", "mop", "vacuum"]
WHEELS: list[ToolAction] = ["trolley", "cart"]


@cache
def body() -> BodyModel:
    return load_body()


def walking(speed: float, turn: float = 0.0) -> BaseMotion:
    """A stiff body that glides: forward, perhaps on a curve; m/s and rad/s."""
    t = np.arange(FRAMES) / 30
    yaw = turn * t
    root = np.zeros((FRAMES, 3))
    root[:, 0], root[:, 1] = (np.cumsum(f(yaw)) * speed / 30 for f in (np.cos, np.sin))
    root[:, 2] = 0.93
    facing = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    c, s, o = np.cos(yaw), np.sin(yaw), 0 * yaw
    R = np.stack([c, -s, o, s, c, o, o, o, o + 1], axis=-1).reshape(-1, 3, 3) @ facing
    return BaseMotion(root, np.repeat(R[:, None], 22, axis=1), np.zeros((FRAMES, 5)), [])


def directed(
    rng: np.random.Generator, body: BodyModel, base_motion: BaseMotion, tool_use: ToolUse
) -> Handling | None:
    trajectory_of = {"trolley": trolley_trajectory, "cart": cart_trajectory}.get(
        tool_use.action, stroke_trajectory
    )
    return trajectory_of(rng, body, base_motion, tool_use)


@cache
def made(action: ToolAction, speed: float, turn: float = 0.0) -> tuple[ToolUse, Handling]:
    """The first job that can be done on a walk without stops."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        prop = placed(rng, MAKERS[PROPS[action]](rng))
        tool_use = draw_tool_use(rng, action, prop, FRAMES)
        if tool_use is None or tool_use.takes or tool_use.leaves:
            continue
        handling = directed(rng, body(), walking(speed, turn), tool_use)
        if handling is not None:
            return tool_use, handling
    raise AssertionError(f"no {action} can be done at all")


def lowest(tool_use: ToolUse, handling: Handling) -> np.ndarray:
    vertices = np.concatenate([p.vertices for p in tool_use.prop.parts])
    return np.array([(vertices @ T[2, :3]).min() + T[2, 3] for T in handling.T_world_prop])


@pytest.mark.parametrize("action", STROKES + WHEELS)
def test_the_tool_stays_on_the_floor(action: ToolAction) -> None:
    tool_use, handling = made(action, 0.4 if action in STROKES else 0.9)
    heights = lowest(tool_use, handling)
    assert heights.min() > -1e-6
    assert heights.max() < 0.01


@pytest.mark.parametrize("action", STROKES)
def test_the_head_strokes_while_the_hands_move_less(action: ToolAction) -> None:
    tool_use, handling = made(action, 0.0)
    foot = np.array([*sole(tool_use.prop).mean(axis=0)[:2], 0.0])
    T = handling.T_world_prop

    def spread(point: np.ndarray) -> float:
        return float(np.linalg.norm(np.std((T[:, :3, :3] @ point + T[:, :3, 3])[:, :2], axis=0)))

    assert 0.06 < spread(foot) < 0.5
    assert all(spread(hold.point) < spread(foot) for hold in handling.holds)
    assert sum(tool_use.hands) == len(handling.holds)


@pytest.mark.parametrize("action", WHEELS)
def test_wheels_roll_along_their_direction(action: ToolAction) -> None:
    tool_use, handling = made(action, 0.9, 0.15)
    T = handling.T_world_prop
    wheels = sole(tool_use.prop)
    low, high = wheels[:, 0].min(), wheels[:, 0].max()
    # One of the axles between the ends never slips aside; the others of a cart swivel.
    slips: list[float] = []
    for x in np.linspace(low, high, 21):
        at = (T[:, :3, :3] @ np.array([x, 0.0, 0.0]) + T[:, :3, 3])[:, :2]
        aside = T[:-1, :2, 1] / np.linalg.norm(T[:-1, :2, 1], axis=-1, keepdims=True)
        slips.append(float(np.abs((np.diff(at, axis=0) * aside).sum(-1)).max() * 30))
    assert min(slips) < 0.03


@pytest.mark.parametrize("action", WHEELS)
def test_nobody_rolls_a_thing_on_the_spot(action: ToolAction) -> None:
    tool_use, _ = made(action, 0.9)
    assert directed(np.random.default_rng(0), body(), walking(0.0), tool_use) is None


def test_nobody_runs_with_a_broom() -> None:
    tool_use, _ = made("sweep", 0.0)
    assert directed(np.random.default_rng(0), body(), walking(1.5), tool_use) is None


@settings(max_examples=60)
@given(st.tuples(*[st.floats(-1, 1)] * 6), st.sampled_from([0, 1]))
def test_a_hand_around_a_bar_is_a_hand(numbers: tuple[float, ...], hand: int) -> None:
    thumb, forearm = np.array(numbers[:3]), np.array(numbers[3:])
    if min(np.linalg.norm(thumb), np.linalg.norm(forearm)) < 0.1:
        return
    thumb, forearm = thumb / np.linalg.norm(thumb), forearm / np.linalg.norm(forearm)
    if np.linalg.norm(np.cross(thumb, forearm)) < 0.05:
        return
    inward, fingers = around(thumb, forearm, hand)
    np.testing.assert_allclose([np.linalg.norm(inward), np.linalg.norm(fingers)], 1.0, atol=1e-9)
    assert abs(inward @ fingers) < 1e-9
    assert abs(inward @ thumb) < 1e-9
    # The thumb of a right hand is at fingers x palm, that of a left one at palm x fingers.
    side = np.cross(fingers, inward) * (1 if hand == 1 else -1)
    assert side @ thumb > 0.8
    assert abs(fingers @ thumb) < 0.51
