"""Parameters of the use of a tool in one clip, drawn before any motion."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.props.prop import Grasp, Prop

ToolAction = Literal["sweep", "mop", "vacuum", "trolley", "cart"]
PROPS: dict[ToolAction, str] = {
    "sweep": "broom",
    "mop": "mop",
    "vacuum": "vacuum",
    "trolley": "suitcase",
    "cart": "pushcart",
}
"""What each action is done with."""
Stroke = Literal["to_and_fro", "sideways", "eight"]
_SOLE = 0.025
"""What is at most so far above the lowest point stands on the floor, metres."""
_HANDS = 0.3
"""Farthest way of the hands in a stroke; the rest is in the slant of the pole, metres."""
_WHEELBASE = 0.35
"""What has no wheels so far apart falls over, metres."""


@dataclass(frozen=True)
class ToolUse:
    """The choices of one clip; lengths in metres, angles in radians, times in frames."""

    action: ToolAction
    prop: Prop
    grasp: Grasp
    hands: tuple[bool, bool]
    """Which hands (left, right) hold it."""
    takes: bool
    """False when it is in the hands from the first frame."""
    leaves: bool
    """False when it is still in the hands at the last frame."""
    reach: int
    release: int
    settle: int
    """Standing still between reaching and going, and between coming and releasing."""
    stops: tuple[int, ...]
    """Stops on the way, at work."""
    stroke: Stroke
    length: float
    """Of a stroke of the head on the floor, from end to end."""
    rate: float
    """Strokes there and back per second."""
    aside: float
    """Direction of the head from the actor's heading, positive to the left."""
    follow: float
    """How much of the head's way the hands go with it."""
    height: float
    """Of the middle of the hands, where the prop leaves a choice."""
    ahead: float
    """From the pelvis to the hands."""
    spare: float
    """Of a pole, beyond the upper hand."""

    @property
    def pause_frames(self) -> list[int]:
        """How long the actor must stand still for each thing that happens standing."""
        take, leave = self.reach + self.settle, self.settle + self.release
        return [take] * self.takes + list(self.stops) + [leave] * self.leaves

    def span(self, pauses: list[tuple[int, int]], frames: int) -> tuple[int, int]:
        """First and one past the last frame in the hands, from where the actor stops."""
        first = pauses[0][0] + self.reach if self.takes else 0
        last = pauses[-1][1] - self.release if self.leaves else frames
        return max(first, 0), min(last, frames)

    @property
    def times(self) -> tuple[int, int]:
        """Frames of reaching and releasing; 0 where the prop stays in the hands."""
        return self.reach * self.takes, self.release * self.leaves


def draw_tool_use(
    rng: np.random.Generator, action: ToolAction, prop: Prop, frames: int
) -> ToolUse | None:
    """Draw everything that belongs to an action; None where the prop cannot be used for it."""
    grasps = [g for g in prop.grasps if _suits(prop, g, action)]
    if not grasps:
        return None
    rolls = action in ("trolley", "cart")
    takes, leaves = (rng.random(2) < 0.55) if rolls else (False, False)
    one = action == "trolley" or (action == "vacuum" and rng.random() < 0.5)
    left = bool(rng.random() < 0.5)
    stroke, length = _stroke(rng, action)
    return ToolUse(
        action=action,
        prop=prop,
        grasp=grasps[rng.integers(len(grasps))],
        hands=(left, not left) if one else (True, True),
        takes=bool(takes),
        leaves=bool(leaves),
        reach=int(rng.uniform(16, 28)),
        release=int(rng.uniform(16, 28)),
        settle=int(rng.uniform(12, 30)),
        stops=_stops(rng, rolls, frames),
        stroke=stroke,
        length=length,
        rate=rng.uniform(0.4, 0.9) * min(1.0, 0.62 / length),
        aside=_aside(rng, action),
        follow=min(rng.uniform(0.35, 0.8), _HANDS / length),
        height=rng.uniform(0.82, 1.05),
        ahead=rng.uniform(0.38, 0.48) if rolls else rng.uniform(0.3, 0.42),
        spare=rng.uniform(0.05, 0.35),
    )


def _suits(prop: Prop, grasp: Grasp, action: ToolAction) -> bool:
    """Two places on one bar: poles for strokes, rails for wheels."""
    if prop.name != PROPS[action]:
        return False
    apart = float(np.linalg.norm(grasp.points[0] - grasp.points[1]))
    if action not in ("trolley", "cart"):
        return (
            grasp.use == "tool" and grasp.kind == "pole" and not grasp.one_handed and apart > 0.12
        )
    across = float(grasp.points[0, 1] - grasp.points[1, 1])
    if grasp.use != "push" or grasp.kind != "rail" or not across > 0.9 * apart > 0.02:
        return False
    on_floor = sole(prop)
    at, height = float(grasp.points[:, 0].mean()), float(grasp.points[:, 2].mean())
    back = float(on_floor[:, 0].min())
    if action == "trolley":
        return abs(at - back) < 0.1 and height > 0.85
    long = float(np.ptp(on_floor[:, 0]))
    return at < back + 0.12 and long > _WHEELBASE and 0.8 < height < 1.1


def sole(prop: Prop) -> Float[np.ndarray, "verts 3"]:
    """The lowest vertices of an upright prop: head or wheels."""
    vertices = np.concatenate([p.vertices for p in prop.parts])
    return vertices[vertices[:, 2] < vertices[:, 2].min() + _SOLE]


def _stops(rng: np.random.Generator, rolls: bool, frames: int) -> tuple[int, ...]:
    """Wheels roll on; strokes are made walking, standing, or first the one and then the other."""
    if rolls or rng.random() < 0.3:
        return ()
    return (int(rng.uniform(0.3, 0.95) * frames),)


def _stroke(rng: np.random.Generator, action: ToolAction) -> tuple[Stroke, float]:
    if action == "mop" and rng.random() < 0.55:
        return ("eight" if rng.random() < 0.4 else "sideways"), rng.uniform(0.35, 0.8)
    return "to_and_fro", rng.uniform(0.3, 0.65 if action == "sweep" else 0.8)


def _aside(rng: np.random.Generator, action: ToolAction) -> float:
    """Brooms are swept beside the body, mops and vacuums before it."""
    if action == "sweep":
        return rng.choice([-1.0, 1.0]) * rng.uniform(0.0, 0.8)
    return float(np.clip(rng.normal(0.0, 0.22), -0.5, 0.5))
