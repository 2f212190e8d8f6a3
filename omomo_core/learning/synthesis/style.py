"""Style of an action: tempo, posture, and where the actor stands to the prop."""

from typing import TypedDict

import numpy as np

from omomo_core.learning.synthesis.action_plan import Action, PropPlacement
from omomo_core.learning.synthesis.posture import Posture
from omomo_core.learning.synthesis.props import Prop
from omomo_core.learning.synthesis.walker.path import CHANCES, Chances


class ReachTempo(TypedDict):
    """Frames of the parts of taking and leaving."""

    reach: int
    lift: int
    lower: int
    release: int


def tempo(rng: np.random.Generator, deep: float, *, slides: bool) -> ReachTempo:
    """One person's pace; `deep` is how far below 0.8 m the hands go, metres."""
    pace = rng.uniform(0.6, 1.25)
    move = 14 * deep if not slides else -10
    return {
        "reach": int(pace * (rng.uniform(14, 26) + 16 * deep)),
        "lift": int(pace * (rng.uniform(15, 26) + move)),
        "lower": int(pace * (rng.uniform(15, 26) + move)),
        "release": int(pace * (rng.uniform(9, 20) + 8 * deep)),
    }


def posture_for(rng: np.random.Generator, action: Action) -> Posture:
    """How somebody holds the body for an action.

    Pushing bodies lean into the load with the pelvis behind the hands, pulling ones hang back from
    it with bent knees; who reaches over a thing stoops; free lifting is anything between stooping
    and squatting, and often one of the two, or all the way down.
    """
    if action in ("push", "shove", "tip", "pivot"):
        lean = rng.uniform(-0.05, 0.5)
        return Posture(
            squat=rng.uniform(0.0, 0.35),
            lean=lean,
            shift=0.1 * lean + rng.normal(0.0, 0.03),
            crouch=rng.uniform(0.0, 0.04),
            comfort=rng.uniform(0.86, 1.0),
            twist=rng.uniform(0.3, 1.0),
        )
    if action == "reach_over":
        return Posture(
            squat=rng.uniform(0.0, 0.35),
            lean=rng.uniform(-0.05, 0.3),
            comfort=rng.uniform(0.9, 1.0),
            twist=rng.uniform(0.5, 1.1),
        )
    if action in ("pull", "drag"):
        return Posture(
            squat=rng.uniform(0.0, 0.5),
            lean=rng.uniform(-0.25, 0.3),
            shift=-rng.uniform(0.0, 0.12),
            crouch=rng.uniform(0.0, 0.04),
            comfort=rng.uniform(0.92, 1.03),
            twist=rng.uniform(0.3, 1.0),
        )
    return Posture(
        squat=rng.uniform(1.0, 2.0) if rng.random() < _SIT else rng.beta(0.6, 1.0),
        lean=rng.normal(0.0, 0.08),
        shift=rng.normal(0.0, 0.025),
        crouch=max(0.0, rng.normal(0.0, 0.02)),
        comfort=rng.uniform(0.82, 0.97),
        twist=rng.uniform(0.4, 1.1),
    )


_SIT = 0.2
"""How often somebody sits down on the heels for what lies low."""
_BESIDE = 0.5
"""How often what is pushed is first taken from more or less beside it."""
_FAR = ("push", "pull", "drag", "shove", "tip", "pivot")
"""What is done at arm's length."""


def stance_for(rng: np.random.Generator, action: Action, turn: float, moment: int) -> PropPlacement:
    """Where the prop is, seen from the actor; `moment` 0 when taken, 1 while held, 2 when left."""
    spread = {"carry": 0.24, "relocate": 0.3, "one_hand": 0.08, "drag": 0.22, "pull": 0.22,
              "push": 0.18, "turn": 0.15}.get(action, 0.26)  # fmt: skip
    if moment == 1 and action not in ("push", "pull", "drag"):
        spread *= 0.6
    if moment == 0 and action == "push" and rng.random() < _BESIDE:
        spread *= 2.5
    far = action in _FAR
    reach = rng.uniform(0.2, 0.62) if far else 0.14 + rng.gamma(2.0, 0.06)
    skew = {"push": 0.2, "pull": 0.25, "drag": 0.25}.get(action, 0.16)
    return PropPlacement(
        swing=float(np.clip(rng.normal(0.0, spread), -2.2 * spread, 2.2 * spread)),
        turn=turn + float(np.clip(rng.normal(0.0, skew), -0.5, 0.5)),
        reach=float(np.clip(reach, 0.16, 0.75)),
        aside=rng.normal(0.0, 0.04),
        pitch=rng.normal(0.0, 0.1) if moment == 1 and not far and action != "one_hand" else 0.0,
    )


def moves_for(action: Action) -> Chances:
    """How somebody moves between stops during an action."""
    return _MOVES.get(action, CHANCES)


def way_of(rng: np.random.Generator, action: Action) -> int:
    """Pushing leads ahead and pulling backward; now and then a thing is swung round or slid aside."""
    if rng.random() < _ANYHOW.get(action, 0.12):
        return 0
    return {"push": 1, "pull": -1, "drag": -1}.get(action, 0)


def tilt_for(rng: np.random.Generator, action: Action, prop: Prop, palm: float) -> float:
    """Tilt of what slides or is tipped, its top away from the actor, radians.

    The side that is held rises, as the hands take its weight off the floor; what is tall for its
    depth may also be tipped towards whoever pulls it, its far side off the floor.
    """
    tall = palm > float(prop.high[0] - prop.low[0])
    towards = tall and action != "push" and rng.random() < 0.6
    often, least, most = _TILTS[action]
    return float((rng.random() < often) * rng.uniform(least, most) * (-1 if towards else 1))


_TILTS: dict[Action, tuple[float, float, float]] = {
    "push": (0.25, 0.02, 0.14), "pull": (0.6, 0.02, 0.25), "drag": (1.0, 0.08, 0.45),
    "tip": (1.0, 0.12, 0.6), "turn": (0.6, 0.06, 0.6),
}  # fmt: skip
"""How often, from, to."""
_ANYHOW: dict[Action, float] = {"drag": 0.35, "push": 0.4}
"""How often a thing goes where it goes: people who stand beside what they push swing it round first."""
_DRAG: Chances = {"back": 0.66, "side": 0.08, "orbit": 0.18, "shuffle": 0.08}
_MOVES: dict[Action, Chances] = {
    "push": {"walk": 0.6, "shuffle": 0.08, "orbit": 0.16, "side": 0.1, "turn": 0.06},
    "pull": _DRAG,
    "drag": _DRAG,
    "turn": {"orbit": 0.75, "turn": 0.25},
    "relocate": {
        "walk": 0.12, "back": 0.12, "side": 0.2, "shuffle": 0.34, "turn": 0.1, "orbit": 0.12,
    },
}  # fmt: skip
