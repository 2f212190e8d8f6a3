"""What happens in one clip: an action as episodes of taking a prop, moving it and leaving it."""

from dataclasses import dataclass
from typing import Literal

from omomo_core.learning.synthesis.base_motion_search import MotionRequirements
from omomo_core.learning.synthesis.posture import Posture
from omomo_core.learning.synthesis.props import Grasp, Prop

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
    """Where the prop is, seen from the actor; radians and metres."""

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
    """Of the prop's bottom while held, visited in this order; empty when it slides."""
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
    """Of the base motion."""

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
