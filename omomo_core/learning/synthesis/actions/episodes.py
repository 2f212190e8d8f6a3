"""What the episodes of all actions have in common: how a prop is held, from where to where, how high."""

from dataclasses import replace

import numpy as np

from omomo_core.learning.synthesis.action_plan import Action, Episode
from omomo_core.learning.synthesis.props import Grasp, Prop, Use, side_grasp
from omomo_core.learning.synthesis.style import stance_for, tempo

LEVELS: dict[str, tuple[float, float, float]] = {
    "low": (0.3, 0.76, 0.92),
    "waist": (0.35, 0.92, 1.12),
    "chest": (0.25, 1.12, 1.38),
    "overhead": (0.16, 1.55, 1.95),
}
"""Chance, lowest and highest palm height while carrying, metres."""
LOWEST_FLIGHT = 0.03
"""Of the bottom of what is carried, metres."""
_HEAVIEST_OVERHEAD = 12.0
"""Kilograms."""
_MOST_TORQUE = 1.2
"""Kilograms times metres that two hands above the head keep from tipping: about 12 N m."""
_TURNED_OVER = 0.5
"""How often a thing is turned about the line through the palms while the arms rise above the head."""
_MOST_HANGING = 0.45
"""Below hands above the head, metres; more would hang before the chest, and is turned over."""
_TAKEN_STANDING = ([0.4, 0.8, 1.2, 1.5], [0.1, 1.0, 1.0, 0.4])
_TAKEN_LOW = ([0.1, 0.25, 0.5, 0.8], [0.5, 1.0, 0.7, 0.2])
"""How readily hands go to a height: metres, share."""
OFTEN_LOW = 0.2
"""How often what is lifted is taken low."""
_IN_ONE_HAND = 0.35
"""Chance that what can be lifted with one hand is."""
_LOW = 0.3
"""Height of what people push along with one hand as often as with two, metres."""
_OFTEN_ONE_HAND: tuple[Action, ...] = ("push", "pull", "drag", "shove", "tip", "turn")
"""What is done to a standing thing, often with one hand."""


def use_of(action: Action) -> Use:
    """What a prop must be good for."""
    if action in ("push", "pull", "drag", "shove"):
        return "push"
    if action in ("tip", "pivot"):
        return "tip"
    return "one_hand" if action == "one_hand" else "lift"


def takes_and_leaves(rng: np.random.Generator, *, stands: bool = True) -> tuple[bool, bool]:
    """Whether the prop is taken and left within the clip; what cannot stand stays in the hands."""
    options = [(True, True), (True, False), (False, True), (False, False)]
    return options[rng.choice(4, p=[0.62, 0.16, 0.14, 0.08]) if stands else 3]


def draw_grasp(
    rng: np.random.Generator, prop: Prop, use: Use, low: float = 0.0
) -> tuple[Grasp, float]:
    """A way to hold the prop, and how the prop is turned toward the actor for it.

    Args:
        rng: source of all randomness.
        prop: what is held.
        use: what for.
        low: how often it is taken low, as one must who wants it high (a chair by its legs).
    """
    grasps = [g for g in prop.grasps if g.use == use]
    # Else nobody stoops for what can be held standing.
    wishes = _TAKEN_LOW if rng.random() < low else _TAKEN_STANDING
    heights = np.array([float(g.points[:, 2].min()) for g in grasps])
    easy = np.interp(heights, *wishes) ** 2
    grasp = grasps[rng.choice(len(grasps), p=easy / easy.sum())]
    turn = 0.0
    if use == "lift" and rng.random() < 0.35:
        turn = rng.uniform(-np.pi, np.pi)
        around = side_grasp(prop, turn, float(grasp.points[:, 2].mean()))
        if around is not None:
            return around, turn
        turn = 0.0
    return grasp, turn


def draw_lift(rng: np.random.Generator, prop: Prop) -> tuple[Grasp, float]:
    """As `draw_grasp` for lifting: light things that offer it are now and then taken in one hand."""
    one = any(g.use == "one_hand" and g.kind != "handle" for g in prop.grasps)
    use: Use = "one_hand" if one and rng.random() < _IN_ONE_HAND else "lift"
    return draw_grasp(rng, prop, use, OFTEN_LOW)


def draw_episode(
    rng: np.random.Generator,
    action: Action,
    prop: Prop,
    grip: tuple[Grasp, float],
    ends: tuple[bool, bool] = (True, True),
    supports: tuple[float, float] = (0.0, 0.0),
    **more: object,
) -> Episode:
    """An episode with everything drawn that is not given."""
    grasp, turn = grip
    palm = float(grasp.points[:, 2].mean())
    deep = max(0.0, 0.8 - palm - min(supports))
    stands = not more.get("heights")
    often = 0.5 if prop.high[2] < _LOW else 0.25
    one = grasp.one_handed or (stands and action in _OFTEN_ONE_HAND and rng.random() < often)
    left = bool(rng.random() < 0.5)
    pause = tempo(rng, deep, slides=grasp.use == "push")
    late = int(rng.uniform(2, 14)) if rng.random() < 0.5 and not one else 0
    drawn: dict[str, object] = {
        "grasp": grasp,
        "hands": (left, not left) if one else (True, True),
        "takes": ends[0],
        "leaves": ends[1],
        "still": False,
        "hold": int(rng.uniform(20, 100)),
        "rest": int(rng.uniform(4, 40)),
        "stops": (),
        "standing": (rng.uniform(-0.7, 0.4), rng.uniform(-0.9, 0.6)),
        "stances": tuple(stance_for(rng, action, turn, moment) for moment in range(3)),
        "heights": (),
        "supports": supports,
        "late": (late, 0) if left else (0, late),
        "off": (int(rng.uniform(20, 90)), int(rng.uniform(22, 45)))
        if not one and rng.random() < 0.15
        else None,
    }
    return Episode(**(drawn | pause | more))  # pyright: ignore[reportArgumentType]


def draw_level(rng: np.random.Generator, prop: Prop, grasp: Grasp, names: list[str]) -> float:
    """Height of the bottom of a prop whose palms are at one of some levels."""
    high = poised(prop, grasp)
    chances = np.array([LEVELS[n][0] * (n != "overhead" or high) for n in names])
    name = str(rng.choice(names, p=chances / chances.sum()))
    palm = float(grasp.points[:, 2].mean())
    return max(LOWEST_FLIGHT, rng.uniform(*LEVELS[name][1:]) - palm)


def poised(prop: Prop, grasp: Grasp) -> bool:
    """Whether somebody can hold the prop above the head so: light, in both hands, and balanced.

    Arms that are up have no lever: the middle of the thing must be over or under the palms, however
    large it is.
    """
    off = float(grasp.points[:, 0].mean() - (prop.low[0] + prop.high[0]) / 2)
    balanced = prop.mass < _HEAVIEST_OVERHEAD and prop.mass * abs(off) < _MOST_TORQUE
    clear = _turns(grasp) or grasp.points[:, 2].mean() < _MOST_HANGING
    return bool(balanced and clear and not grasp.one_handed)


def _turns(grasp: Grasp) -> bool:
    """Whether a thing held so can turn about the palms."""
    return grasp.kind in ("side", "rim")


def turned_over(rng: np.random.Generator, episode: Episode) -> Episode:
    """Now and then what goes overhead turns with the forearms, its top towards the actor.

    Held at two opposite sides it turns about the palms, a quarter or all the way, so that what is
    below it (the legs of a table) does not come down on the head.
    """
    palm = float(episode.grasp.points[:, 2].mean())
    highest = max(episode.heights, default=0.0)
    overhead = highest + palm >= LEVELS["overhead"][1]
    stays = palm < _MOST_HANGING and rng.random() > _TURNED_OVER
    if not overhead or not _turns(episode.grasp) or stays:
        return episode
    pitch = -rng.uniform(0.3, 1.1) * np.pi
    more = int(12 * abs(pitch))
    return replace(
        episode,
        heights=(highest,),
        stances=(
            episode.stances[0], replace(episode.stances[1], pitch=pitch), episode.stances[2],
        ),
        lift=episode.lift + more,
        lower=episode.lower + more,
    )  # fmt: skip


def draw_support(rng: np.random.Generator, prop: Prop, palm: float, scale: float) -> float:
    """The floor, or something to stand small things on."""
    if (prop.high - prop.low).max() > 0.4 or rng.random() < 0.7:
        return 0.0
    return max(0.0, min(rng.uniform(0.35, 0.8) * scale, 1.35 - palm))
