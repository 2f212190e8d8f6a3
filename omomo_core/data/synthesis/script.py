"""What happens in one clip: which action, with what, how high, how fast. Pure numbers, no motion yet."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from omomo_core.data.synthesis.props import Grasp, Prop, Use, make_prop

Action = Literal["carry", "in_place", "push", "pull", "one_hand"]
_ACTIONS: dict[Action, float] = {
    "carry": 0.42,
    "in_place": 0.16,
    "push": 0.16,
    "pull": 0.12,
    "one_hand": 0.14,
}
_USES: dict[Action, Use] = {
    "carry": "lift",
    "in_place": "lift",
    "push": "push",
    "pull": "push",
    "one_hand": "one_hand",
}
_HOLDS: dict[str, tuple[float, float, float]] = {
    "low": (0.3, 0.72, 0.92),
    "waist": (0.35, 0.92, 1.12),
    "chest": (0.25, 1.12, 1.38),
    "overhead": (0.1, 1.6, 1.82),
}
"""Chance, lowest and highest palm height while carrying, metres."""
_LOWEST_FLIGHT = 0.04


@dataclass(frozen=True)
class Script:
    """The choices of one clip; heights in metres, angles in radians, times in frames."""

    action: Action
    prop: Prop
    grasp: Grasp
    hands: tuple[bool, bool]
    """Which hands (left, right) hold the prop."""
    takes: bool
    """False when the prop is in the hands from the first frame."""
    leaves: bool
    """False when it is still in the hands at the last frame."""
    reach: int
    lift: int
    hold: int
    """Frames held at one place; only in_place."""
    lower: int
    release: int
    rest_heights: tuple[float, float]
    """Height of what the prop stands on when it is taken and left."""
    hold_height: float
    """Height of the prop's bottom while it is carried."""
    swings: tuple[float, float, float]
    """Direction of the prop from the actor's heading when taken, carried and left."""
    turns: tuple[float, float, float]
    """Yaw of the prop against that direction when taken, carried and left."""
    tilt: float
    """Pitch about the palms while carried."""
    squat: float
    """How low things are reached: 0 by bending the back, 1 by bending the knees."""
    lean: float
    """Forward lean of the trunk while holding."""
    distance: float
    """Least distance from the pelvis to the near side of the prop."""

    @property
    def pause_frames(self) -> list[int]:
        """How long the actor must stand still for each thing that happens standing."""
        take, leave = self.reach + self.lift, self.lower + self.release
        if self.action == "in_place":
            return [take + self.hold + leave]
        return [take] * self.takes + [leave] * self.leaves

    def contact_frames(self, pauses: list[tuple[int, int]], frames: int) -> tuple[int, int]:
        """First and one-past-last frame with the prop in the hands, from where the actor stops."""
        first = pauses[0][0] + self.reach if self.takes else 0
        last = pauses[-1][1] - self.release if self.leaves else frames
        return max(first, 0), min(last, frames)

    @property
    def on_floor(self) -> bool:
        """The prop slides over the floor and is never lifted."""
        return self.grasp.use == "push"


def draw_action(rng: np.random.Generator) -> Action:
    """A random action, as often as people do it."""
    return list(_ACTIONS)[rng.choice(len(_ACTIONS), p=list(_ACTIONS.values()))]


def write_script(rng: np.random.Generator, action: Action) -> Script:
    """Draw everything that belongs to an action."""
    use = _USES[action]
    prop = make_prop(rng, use)
    grasps = [g for g in prop.grasps if g.use == use]
    grasp = grasps[rng.integers(len(grasps))]
    palm = float(grasp.points[:, 2].mean())
    rests = (0.0, 0.0) if use == "push" else (_rest(rng, prop, palm), _rest(rng, prop, palm))
    deep = max(0.0, 0.8 - palm - min(rests))
    left_hand = bool(rng.random() < 0.5)
    takes, leaves = _takes_and_leaves(rng, action)
    return Script(
        action=action,
        prop=prop,
        grasp=grasp,
        hands=(True, True) if use != "one_hand" else (left_hand, not left_hand),
        takes=takes,
        leaves=leaves,
        reach=int(rng.uniform(16, 26) + 16 * deep),
        lift=int(rng.uniform(16, 26) + 14 * deep) if use != "push" else int(rng.uniform(6, 12)),
        hold=int(rng.uniform(30, 110)),
        lower=int(rng.uniform(16, 26) + 14 * deep) if use != "push" else int(rng.uniform(6, 12)),
        release=int(rng.uniform(16, 26) + 16 * deep),
        rest_heights=rests,
        hold_height=0.0 if use == "push" else _hold_height(rng, use, prop, palm),
        swings=_swings(rng, action),
        turns=_turns(rng, action),
        tilt=rng.normal(0.0, 0.1) if use == "lift" and palm > 0.1 else 0.0,
        squat=rng.uniform(0.0, 0.35) if use == "push" else rng.uniform(0.15, 0.9),
        lean=rng.uniform(0.08, 0.4) if action == "push" else rng.uniform(-0.1, 0.06),
        distance=rng.uniform(0.28, 0.45) if use == "push" else rng.uniform(0.14, 0.26),
    )


def _takes_and_leaves(rng: np.random.Generator, action: Action) -> tuple[bool, bool]:
    if action == "in_place":
        return True, True
    options = [(True, True), (True, False), (False, True), (False, False)]
    return options[rng.choice(4, p=[0.45, 0.22, 0.18, 0.15])]


def _rest(rng: np.random.Generator, prop: Prop, palm: float) -> float:
    """The floor, or something to stand small things on."""
    if prop.high[2] > 0.7 or rng.random() < 0.6:
        return 0.0
    return max(0.0, min(rng.uniform(0.3, 1.0), 1.35 - palm))


def _hold_height(rng: np.random.Generator, use: Use, prop: Prop, palm: float) -> float:
    if use == "one_hand":
        return max(_LOWEST_FLIGHT, rng.uniform(0.68, 0.78) - palm)
    if prop.name == "lamp":
        return rng.uniform(_LOWEST_FLIGHT, 0.35)
    chances = np.array([h[0] for h in _HOLDS.values()])
    if prop.high[2] > 0.6 or prop.high[0] - prop.low[0] > 0.5:
        chances[-1] = 0.0
    name = rng.choice(list(_HOLDS), p=chances / chances.sum())
    _, low, high = _HOLDS[str(name)]
    return max(_LOWEST_FLIGHT, rng.uniform(low, high) - palm)


def _swings(rng: np.random.Generator, action: Action) -> tuple[float, float, float]:
    spread = {"in_place": 0.45, "one_hand": 0.08, "push": 0.06, "pull": 0.06}.get(action, 0.22)
    a, b, c = rng.normal(0.0, spread, 3).clip(-2 * spread, 2 * spread)
    return float(a), float(b * (0.7 if action == "in_place" else 0.3)), float(c)


def _turns(rng: np.random.Generator, action: Action) -> tuple[float, float, float]:
    a, b, c = rng.normal(0.0, 0.12, 3).clip(-0.25, 0.25)
    extra = rng.uniform(-0.5, 0.5) if action == "in_place" else 0.0
    return float(a), float(b + extra), float(c)
