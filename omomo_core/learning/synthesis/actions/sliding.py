"""Actions in which a prop stays on the floor: slid by walking, moved by the arms alone, turned."""

from dataclasses import replace
from typing import Any

import numpy as np

from omomo_core.learning.synthesis.action_plan import Action, Episode, Shove
from omomo_core.learning.synthesis.actions.episodes import (
    draw_episode,
    draw_grasp,
    draw_lift,
    takes_and_leaves,
    use_of,
)
from omomo_core.learning.synthesis.props import Grasp, Prop, side_grasp
from omomo_core.learning.synthesis.style import stance_for, tilt_for

_LOW = 0.65
"""Height of what nobody pushes standing, metres."""


def slide(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Pushed or pulled over the floor by walking, with stops; dragged is mostly what is low."""
    if action == "drag" and prop.high[2] > _LOW and rng.random() < 0.7:
        return []
    grip = draw_grasp(rng, prop, "push")
    stops = tuple(int(s) for s in rng.uniform(6, 40, rng.choice([0, 1, 2], p=[0.6, 0.3, 0.1])))
    ends = takes_and_leaves(rng, stands=prop.stands)
    more = _tilted(rng, action, prop, grip)
    return [draw_episode(rng, action, prop, grip, ends, stops=stops, **more)]


def _tilted(
    rng: np.random.Generator, action: Action, prop: Prop, grip: tuple[Grasp, float]
) -> dict[str, Any]:
    """Of an episode in which a thing slides: where it is to the actor, and how it is tilted for it."""
    taken, held, left = (stance_for(rng, action, grip[1], m) for m in range(3))
    tilt = tilt_for(rng, action, prop, float(grip[0].points[:, 2].mean()))
    moves = {"lift": int(rng.uniform(14, 24)), "lower": int(rng.uniform(14, 24))}
    return {"stances": (taken, replace(held, pitch=tilt), left)} | (moves if tilt else {})


def shove(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Pushed, pulled or tipped with the arms only, several times."""
    grip = draw_grasp(rng, prop, use_of(action))
    episodes: list[Episode] = []
    for _ in range(int(rng.choice([1, 2, 3], p=[0.4, 0.35, 0.25]))):
        shove = Shove(
            ahead=rng.uniform(-0.22, 0.3),
            aside=rng.uniform(-0.15, 0.15),
            yaw=rng.uniform(-0.35, 0.35),
            back=rng.random() < 0.2,
        )
        if action == "tip":
            palm = float(grip[0].points[:, 2].mean())
            shove = Shove(pitch=tilt_for(rng, action, prop, palm), back=True)
        moving = int(rng.uniform(16, 32) + 25 * (abs(shove.pitch) + abs(shove.ahead)))
        episodes.append(
            draw_episode(
                rng, action, prop, grip, still=True, shove=shove, lift=moving,
                lower=moving if shove.back else 8, hold=int(rng.uniform(0, 50)),
            )
        )  # fmt: skip
    return episodes


def turn(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Turned on the spot: by walking round it, or by strokes of the arms and re-grasping."""
    if rng.random() < 0.55:
        slides = any(g.use == "push" for g in prop.grasps) and rng.random() < 0.75
        grip = draw_grasp(rng, prop, "push") if slides else draw_lift(rng, prop)
        palm = float(grip[0].points[:, 2].mean())
        lifted = not slides and rng.random() < 0.6
        heights = (max(rng.uniform(0.03, 0.15), rng.uniform(0.4, 0.9) - palm),) if lifted else ()
        ends = takes_and_leaves(rng, stands=prop.stands)
        more = _tilted(rng, action, prop, grip) if slides else {}
        return [draw_episode(rng, action, prop, grip, ends, heights=heights, **more)]
    height = prop.high[2] * rng.uniform(0.6, 0.95)
    at, way = rng.uniform(-np.pi, np.pi), float(rng.choice([-1, 1]))
    episodes: list[Episode] = []
    for _ in range(int(rng.integers(1, 5))):
        grasp = side_grasp(prop, at, height)
        if grasp is None:
            return []
        step = way * rng.uniform(0.3, 0.8)
        episodes.append(
            draw_episode(
                rng, action, prop, (grasp, at), still=True, shove=Shove(yaw=step),
                lift=int(rng.uniform(14, 22) + 15 * abs(step)), lower=6,
                hold=int(rng.uniform(0, 8)), rest=int(rng.uniform(2, 10)), off=None,
            )
        )  # fmt: skip
        at += step
    return episodes


def pivot(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Swung round on its legs with one hand on top, tipped on the way, by somebody who stands still."""
    grip, _ = draw_grasp(rng, prop, "tip")
    palm = float(grip.points[:, 2].mean())
    start = rng.choice([-0.5, 0.0, 0.5]) * np.pi + rng.uniform(-0.5, 0.5)
    left = bool(rng.random() < 0.5)
    episodes: list[Episode] = []
    for _ in range(int(rng.choice([1, 2], p=[0.7, 0.3]))):
        round_by = float(rng.choice([-1, 1]) * rng.uniform(0.8, 2.4))
        tilt = abs(tilt_for(rng, "tip", prop, palm)) * float(rng.choice([-1, 1]))
        shove = Shove(rng.uniform(-0.1, 0.2), rng.uniform(-0.15, 0.15), round_by, tilt=tilt)
        episodes.append(
            draw_episode(
                rng, action, prop, (grip, start), still=True, shove=shove, off=None,
                hands=(left, not left), lift=int(rng.uniform(18, 26) + 12 * abs(round_by)),
                lower=8, hold=int(rng.uniform(0, 30)), rest=int(rng.uniform(2, 20)),
            )
        )  # fmt: skip
        start += round_by
    return episodes
