"""Actions in which one hand reaches over a thing to its far edge while the other holds the near one."""

from dataclasses import replace

import numpy as np

from omomo_core.learning.synthesis.actions.episodes import (
    LOWEST_FLIGHT,
    draw_episode,
    takes_and_leaves,
)
from omomo_core.learning.synthesis.props import Grasp, Prop, side_grasp
from omomo_core.learning.synthesis.script import Action, Episode

_LOWEST, _HIGHEST = 0.25, 0.8
"""Height of what somebody reaches over, metres."""
_NARROWEST, _WIDEST = 0.3, 0.75
"""Between the palms, metres."""
_ROUND = (0.6, 1.5)
"""How far the line through the palms is turned, from left and right to near and far, radians."""


def reach_over(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Taken at near and far edge, lifted, its far side up towards the breast, put down close by."""
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
    """Palms on opposed sides of a low thing, and the yaw that brings one near and the other far."""
    top = float(prop.high[2])
    if not _LOWEST < top < _HIGHEST:
        return None
    turn = float(rng.uniform(-np.pi, np.pi) if rng.random() < 0.3 else rng.integers(4) * np.pi / 2)
    grasp = side_grasp(prop, turn, top - rng.uniform(0.0, 0.08))
    if grasp is None:
        return None
    apart = float(np.linalg.norm(grasp.points[0] - grasp.points[1]))
    if not _NARROWEST < apart < _WIDEST:
        return None
    return grasp, turn + float(rng.choice([-1, 1]) * rng.uniform(*_ROUND))
