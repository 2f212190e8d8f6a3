"""The grammar of actions, and a writer of episodes for each."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from omomo_core.learning.synthesis.action_plan import (
    Action,
    ActionPlan,
    Episode,
    PropPlacement,
    Shove,
    moves_for,
    posture_for,
    stance_for,
    tempo,
    tilt_for,
    timeline,
    way_of,
)
from omomo_core.learning.synthesis.base_motion_search import MotionRequirements
from omomo_core.learning.synthesis.props import (
    ALL,
    Grasp,
    Prop,
    Stock,
    Use,
    make_prop,
    scaled,
    side_grasp,
)
from omomo_core.learning.synthesis.tool_use import PROPS as TOOL_PROPS

LEVELS: dict[str, tuple[float, float, float]] = {
    "low": (0.3, 0.76, 0.92),
    "waist": (0.35, 0.92, 1.12),
    "chest": (0.25, 1.12, 1.38),
    "overhead": (0.16, 1.55, 1.95),
}
"""Chance, lowest and highest palm height while carrying, metres."""
LOWEST_FLIGHT = 0.03
"""Least height of the bottom of what is carried, metres."""
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
_LOW_PROP = 0.3
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
    """Draw a grasp for lifting: light things that offer it are now and then taken in one hand."""
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
    often = 0.5 if prop.high[2] < _LOW_PROP else 0.25
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


_LOWEST_STANDING = 0.65
"""Height of what nobody pushes standing, metres."""


def slide(rng: np.random.Generator, action: Action, prop: Prop, scale: float) -> list[Episode]:
    """Pushed or pulled over the floor by walking, with stops; dragged is mostly what is low."""
    if action == "drag" and prop.high[2] > _LOWEST_STANDING and rng.random() < 0.7:
        return []
    grip = draw_grasp(rng, prop, "push")
    stops = tuple(int(s) for s in rng.uniform(6, 40, rng.choice([0, 1, 2], p=[0.6, 0.3, 0.1])))
    ends = takes_and_leaves(rng, stands=prop.stands)
    more = _tilted(rng, action, prop, grip)
    return [draw_episode(rng, action, prop, grip, ends, stops=stops, **more)]


def _tilted(
    rng: np.random.Generator, action: Action, prop: Prop, grip: tuple[Grasp, float]
) -> dict[str, Any]:
    """Return the prop's place and tilt in an episode in which it slides."""
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
