"""The grammar of actions: how often each action is done, with which props, and in which manner."""

from collections.abc import Callable

import numpy as np

from omomo_core.learning.synthesis.action_plan import Action, ActionPlan, Episode, timeline
from omomo_core.learning.synthesis.actions.episodes import use_of
from omomo_core.learning.synthesis.actions.lifting import (
    carry,
    flip,
    in_place,
    reach_over,
    relocate,
)
from omomo_core.learning.synthesis.actions.sliding import pivot, shove, slide, turn
from omomo_core.learning.synthesis.base_motion_search import MotionRequirements
from omomo_core.learning.synthesis.props import ALL, Prop, Stock, make_prop, scaled
from omomo_core.learning.synthesis.style import moves_for, posture_for, way_of
from omomo_core.learning.synthesis.tools.tool_use import PROPS as TOOL_PROPS

_ACTIONS: dict[Action, float] = {
    "carry": 0.14, "relocate": 0.12, "in_place": 0.06, "raise": 0.1, "one_hand": 0.06,
    "swing": 0.02, "flip": 0.01, "reach_over": 0.05, "push": 0.18, "pull": 0.06, "drag": 0.12,
    "shove": 0.02, "turn": 0.07, "tip": 0.02, "pivot": 0.05,
    "sweep": 0.01, "mop": 0.01, "vacuum": 0.01, "trolley": 0.01, "cart": 0.01,
}  # fmt: skip
_TRIES = 30
_SHORTEST, _LONGEST = 120, 300
"""Frames of a clip."""
_WALKING: dict[Action, tuple[float, float]] = {"relocate": (25, 60), "push": (35, 130)}
"""Frames of walking with the thing in each episode."""
_RATES: dict[Action, tuple[float, float]] = {"push": (0.5, 1.2)}
"""How fast recorded walks are played to somebody who slides a thing."""
_Writer = Callable[[np.random.Generator, Action, Prop, float], list[Episode]]
_WRITERS: dict[Action, _Writer] = {
    "carry": carry, "one_hand": carry, "relocate": relocate, "in_place": in_place,
    "raise": in_place, "swing": in_place, "flip": flip, "push": slide, "pull": slide,
    "drag": slide, "shove": shove, "tip": shove, "turn": turn, "pivot": pivot,
    "reach_over": reach_over,
}  # fmt: skip


def draw_action(rng: np.random.Generator, stock: Stock = ALL) -> Action:
    """A random action that something can be used for, as often as people do it."""
    possible: list[Action] = [action for action in _ACTIONS if _possible(action, stock)]
    chances = np.array([_ACTIONS[action] for action in possible])
    return possible[rng.choice(len(chances), p=chances / chances.sum())]


def _possible(action: Action, stock: Stock) -> bool:
    if action in TOOL_PROPS:
        return stock.classes is None or TOOL_PROPS[action] in stock.classes
    return bool(stock.of_use(use_of(action)))


def draw_action_plan(
    rng: np.random.Generator, action: Action, scale: float = 1.0, stock: Stock = ALL
) -> ActionPlan | None:
    """Draw everything that belongs to an action.

    Args:
        rng: source of all randomness.
        action: not one with a tool.
        scale: our stature over the actor's.
        stock: what there is to handle.

    Returns:
        None where hardly anything there is can be used so (nobody relocates what does not stand).
    """
    for _ in range(_TRIES):
        prop = scaled(make_prop(rng, use_of(action), stock), scale)
        episodes = _WRITERS[action](rng, action, prop, scale)
        action_plan = _action_plan(rng, action, prop, episodes) if episodes else None
        if action_plan is not None:
            return action_plan
    return None


def _action_plan(
    rng: np.random.Generator, action: Action, prop: Prop, episodes: list[Episode]
) -> ActionPlan | None:
    """Fit the episodes into a clip of a length that suits them; None when they take too long."""
    slow = episodes[0].slides
    walks = sum(not e.still for e in episodes)
    stepping = action == "relocate"
    walking = walks * rng.uniform(*_WALKING.get(action, (60, 150)))
    pauses = timeline(tuple(episodes))[0]
    spare = 0.0 if rng.random() < 0.4 else rng.uniform(0, 70)
    coming_and_going = int(episodes[0].takes) + int(episodes[-1].leaves)
    way = rng.uniform(15, 75, coming_and_going).sum()
    frames = int(max(sum(pauses) + walking + spare + way, _SHORTEST))
    if frames > _LONGEST:
        return None
    wanted = MotionRequirements(
        frames,
        pauses,
        rate=_RATES.get(action, (0.45, 0.9)) if slow else (0.7, 1.2),
        walk=(10, 50) if stepping else (24, _LONGEST),
        backward={"pull": 0.9, "drag": 1.0, "push": 0.05, "relocate": 0.3}.get(action, 0.12),
        moves=moves_for(action),
        made_to_measure=action == "turn" and walks > 0,
        way=way_of(rng, action),
        comes=episodes[0].takes,
        goes=episodes[-1].leaves,
    )
    return ActionPlan(action, prop, tuple(episodes), posture_for(rng, action), wanted)
