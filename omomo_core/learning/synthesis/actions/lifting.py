"""Actions in which a prop is lifted: carried, relocated, handled in place, flipped, reached over."""

from dataclasses import replace

import numpy as np

from omomo_core.learning.synthesis.action_plan import Action, Episode, PropPlacement
from omomo_core.learning.synthesis.actions.episodes import (
    LEVELS,
    LOWEST_FLIGHT,
    OFTEN_LOW,
    draw_episode,
    draw_grasp,
    draw_level,
    draw_lift,
    draw_support,
    poised,
    takes_and_leaves,
    turned_over,
    use_of,
)
from omomo_core.learning.synthesis.props import Grasp, Prop, side_grasp
from omomo_core.learning.synthesis.style import stance_for

_TALL = 1.1
"""Height from which a prop is carried upright, low over the floor, metres."""

_LOWEST_TOP, _HIGHEST_TOP = 0.25, 0.8
"""Height of a prop that a hand reaches over, metres."""
_NARROWEST, _WIDEST = 0.3, 0.75
"""Between the palms of somebody who reaches over a prop, metres."""
_ROUND = (0.6, 1.5)
"""How far the line through the palms is turned, from left and right to near and far, radians."""


def carry(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Draw a carry at one or two heights, sometimes with a stop, in one hand or both."""
    use = use_of(action)
    grip = draw_grasp(rng, prop, use, OFTEN_LOW)
    palm = float(grip[0].points[:, 2].mean())
    supports = draw_support(rng, prop, palm, scale), draw_support(rng, prop, palm, scale)
    if use == "one_hand":
        heights = (max(LOWEST_FLIGHT, rng.uniform(0.66, 0.8) - palm),)
    elif grip[0].kind == "pole":
        heights = (rng.uniform(LOWEST_FLIGHT, 0.35),)
    else:
        heights = (draw_level(rng, prop, grip[0], list(LEVELS)),)
        if rng.random() < 0.2:
            heights += (draw_level(rng, prop, grip[0], list(LEVELS)),)
    stops = (int(rng.uniform(8, 40)),) if rng.random() < 0.2 else ()
    ends = takes_and_leaves(rng, stands=prop.stands)
    episode = draw_episode(rng, action, prop, grip, ends, supports, heights=heights, stops=stops)
    return [turned_over(rng, episode)]


def relocate(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Draw one to three short lifts after each of which the prop is put down close by."""
    grip = draw_lift(rng, prop)
    palm = float(grip[0].points[:, 2].mean())
    if not prop.stands:
        return []
    count = int(rng.choice([1, 2, 3], p=[0.45, 0.4, 0.15]))
    episodes: list[Episode] = []
    for k in range(count):
        low = palm + rng.uniform(0.04, 0.35)
        heights = (max(0.03, max(low, rng.uniform(0.6, 1.0)) - palm),)
        ends = (k > 0 or rng.random() < 0.75, k < count - 1 or rng.random() < 0.85)
        episodes.append(
            draw_episode(
                rng, action, prop, grip, ends,
                still=rng.random() < 0.4, heights=heights, hold=int(rng.uniform(4, 40)),
            )
        )  # fmt: skip
    return episodes


def in_place(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Draw a lift in place: the prop is looked at, turned, swung or raised overhead, and put down."""
    high = action == "raise"
    grip = draw_grasp(rng, prop, "lift", low=0.6) if high else draw_lift(rng, prop)
    if high and not poised(prop, grip[0]):
        return []
    palm = float(grip[0].points[:, 2].mean())
    support = draw_support(rng, prop, palm, scale)
    levels = [draw_level(rng, prop, grip[0], ["low", "waist", "chest"])]
    if prop.high[2] > _TALL:
        levels = [rng.uniform(LOWEST_FLIGHT, 0.35)]
    if high:
        levels.append(draw_level(rng, prop, grip[0], ["overhead"]))
        if rng.random() < 0.6:
            levels.append(draw_level(rng, prop, grip[0], ["low", "waist", "chest"]))
    swinging = (rng.uniform(0.12, 0.35), rng.uniform(0.3, 0.7)) if action == "swing" else (0.0, 0.5)
    episode = draw_episode(
        rng, action, prop, grip, takes_and_leaves(rng, stands=prop.stands), (support, support),
        still=not high or rng.random() < 0.7, heights=tuple(levels),
        hold=int(rng.uniform(30, 90) + 25 * len(levels)), swinging=swinging,
        gesture=rng.uniform(0.0, 0.15) if action == "swing" else rng.uniform(0.0, 0.5),
    )  # fmt: skip
    return [turned_over(rng, episode)]


def flip(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Draw a lift in which the prop is turned onto another side about the line through the palms."""
    grip = draw_grasp(rng, prop, "lift")
    palm = float(grip[0].points[:, 2].mean())
    quarter = float(rng.choice([-1, 1])) * np.pi / 2
    if grip[0].kind == "pole":
        return []
    start, middle, end = (stance_for(rng, action, grip[1], m) for m in range(3))
    held = PropPlacement(**(vars(middle) | {"pitch": quarter * rng.uniform(0.3, 0.7)}))
    left = PropPlacement(**(vars(end) | {"pitch": quarter}))
    support = draw_support(rng, prop, palm, scale)
    return [
        draw_episode(
            rng, action, prop, grip, (rng.random() < 0.8, True), (support, support), still=True,
            heights=(draw_level(rng, prop, grip[0], ["low", "waist"]),), stances=(start, held, left),
        )
    ]  # fmt: skip


def reach_over(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Draw lifts by the near and the far edge, with the far side raised towards the chest."""
    grip = _near_and_far(rng, prop)
    if grip is None or not prop.stands:
        return []
    palm = float(grip[0].points[:, 2].mean())
    count = int(rng.choice([1, 2], p=[0.8, 0.2]))
    episodes: list[Episode] = []
    for _ in range(count):
        raised = rng.uniform(0.1, 0.65)
        ends = (True, True) if count > 1 else takes_and_leaves(rng)
        episode = draw_episode(
            rng, action, prop, grip, ends, still=rng.random() < 0.3,
            heights=(max(LOWEST_FLIGHT, min(raised, 1.15 - palm)),),
            hold=int(rng.uniform(10, 60)),
        )  # fmt: skip
        taken, held, left = episode.stances
        held = replace(held, pitch=-rng.uniform(0.0, 1.1) * raised)
        episodes.append(replace(episode, stances=(taken, held, left)))
    return episodes


def _near_and_far(rng: np.random.Generator, prop: Prop) -> tuple[Grasp, float] | None:
    """Return palms on opposed sides of a low prop, and the yaw that brings one near and the other far."""
    top = float(prop.high[2])
    if not _LOWEST_TOP < top < _HIGHEST_TOP:
        return None
    turn = float(rng.uniform(-np.pi, np.pi) if rng.random() < 0.3 else rng.integers(4) * np.pi / 2)
    grasp = side_grasp(prop, turn, top - rng.uniform(0.0, 0.08))
    if grasp is None:
        return None
    apart = float(np.linalg.norm(grasp.points[0] - grasp.points[1]))
    if not _NARROWEST < apart < _WIDEST:
        return None
    return grasp, turn + float(rng.choice([-1, 1]) * rng.uniform(*_ROUND))
