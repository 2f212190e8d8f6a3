"""The plan of one clip: an action as episodes, with its style and stances."""

from dataclasses import dataclass
from typing import Literal, TypedDict

import numpy as np

from omomo_core.learning.synthesis.base_motion_search import MotionRequirements
from omomo_core.learning.synthesis.holds import Posture
from omomo_core.learning.synthesis.props import Grasp, Prop
from omomo_core.learning.synthesis.walker.footsteps import CHANCES, Chances

Action = Literal[
    "carry", "relocate", "in_place", "raise", "one_hand", "swing", "flip",
    "reach_over", "push", "pull", "drag", "shove", "turn", "tip", "pivot",
    "sweep", "mop", "vacuum", "trolley", "cart",
]  # fmt: skip
Span = tuple[int, int]
"""First frame and one past the last."""
_SHORTEST_STOP = 8
"""Frames."""


@dataclass(frozen=True)
class PropPlacement:
    """The prop's place seen from the actor; radians and metres."""

    swing: float = 0.0
    """Direction of the prop from the actor's heading, positive to the left."""
    turn: float = 0.0
    """Yaw of the prop against that direction."""
    reach: float = 0.4
    """From the pelvis to the middle of the palms, farther where the body needs the room."""
    aside: float = 0.0
    """How far the prop's middle is to the left of that direction."""
    pitch: float = 0.0
    """Tilt of the prop, its top away from the actor."""


@dataclass(frozen=True)
class Shove:
    """How a prop is changed by somebody who stands still."""

    ahead: float = 0.0
    aside: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    tilt: float = 0.0
    """Besides, half way: gone again when it is where it goes."""
    back: bool = False
    """It comes back to where it was before it is left."""


@dataclass(frozen=True)
class Episode:
    """From one taking of the prop to its leaving; times in frames, heights in metres."""

    grasp: Grasp
    hands: tuple[bool, bool]
    """Which hands (left, right) hold the prop."""
    takes: bool
    """False when the prop is in the hands from the first frame."""
    leaves: bool
    """False when it is still in the hands at the last frame."""
    still: bool
    """The actor does not walk between taking and leaving."""
    reach: int
    lift: int
    hold: int
    """Frames between lifting and lowering; only where the actor stands still."""
    lower: int
    release: int
    rest: int
    """Frames before the next episode begins, hands off."""
    stops: tuple[int, ...]
    """Lengths of the stops on the way."""
    standing: tuple[float, float]
    """Part of reaching and of letting go for which the actor stands; the rest is done walking up and
    off. Below 0 the actor holds before having come to a stand (though lifts for eight frames standing), or
    still when going off."""
    stances: tuple[PropPlacement, PropPlacement, PropPlacement]
    """When taken, while held, when left."""
    heights: tuple[float, ...]
    """Heights of the prop's bottom while held, visited in this order; empty when it slides."""
    supports: tuple[float, float]
    """Height of what the prop stands on when it is taken and left."""
    shove: Shove | None = None
    """What is done to it in place; None when it goes with the actor."""
    late: tuple[int, int] = (0, 0)
    """How much later than the first each hand arrives, and earlier than the last it leaves."""
    gesture: float = 0.0
    """Turning and tilting while held, radians."""
    swinging: tuple[float, float] = (0.0, 0.5)
    """To and fro: radians to either side, and times per second."""
    off: Span | None = None
    """One hand lets go for a while: how long after taking, and for how long."""

    @property
    def slides(self) -> bool:
        """It stays on the floor."""
        return not self.heights


@dataclass(frozen=True)
class ActionPlan:
    """The choices of one clip."""

    action: Action
    prop: Prop
    episodes: tuple[Episode, ...]
    posture: Posture
    wanted: MotionRequirements
    """Requirements of the base motion."""

    def spans(self, pauses: list[Span]) -> list[Span]:
        """From where the actor stops: the frames each episode has the prop in the hands."""
        out: list[Span] = []
        for take, leave in timeline(self.episodes)[1]:
            first = 0 if take is None else pauses[take[0]][0] + take[1]
            last = self.wanted.frames if leave is None else pauses[leave[0]][0] + leave[1]
            out.append((max(first, 0), min(last, self.wanted.frames)))
        return out


_Cue = tuple[int, int]
"""A pause, and frames since its begin."""


def timeline(
    episodes: tuple[Episode, ...],
) -> tuple[list[int], list[tuple[_Cue | None, _Cue | None]]]:
    """Lengths of the pauses, and when in them each episode takes and leaves the prop."""
    pauses: list[int] = []
    cues: list[tuple[_Cue | None, _Cue | None]] = []
    now = 0
    for k, episode in enumerate(episodes):
        take = leave = None
        if episode.takes:
            share = episode.standing[0] if now == 0 else 1.0
            reaching = max(round(episode.reach * share), _SHORTEST_STOP - episode.lift)
            take = (len(pauses), now + reaching)
            now += reaching + episode.lift
        if episode.still:
            now += episode.hold
        else:
            pauses += [now] * (now > 0) + list(episode.stops)
            now = 0
        if episode.leaves:
            leave = (len(pauses), now + episode.lower)
            share = episode.standing[1] if k == len(episodes) - 1 else 1.0
            now += max(episode.lower + round(episode.release * share), _SHORTEST_STOP)
        now += episode.rest * (k < len(episodes) - 1)
        cues.append((take, leave))
    return pauses + [now] * (now > 0), cues


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
    """Return the prop's place seen from the actor; `moment` 0 when taken, 1 while held, 2 when left."""
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
