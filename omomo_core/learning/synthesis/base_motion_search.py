"""Search for a base motion, recorded or generated, that meets the requirements of an action."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from omomo_core.learning.synthesis.base_motion import (
    BaseMotion,
    Footage,
    mirrored,
    motion_with_stops,
    reversed_in_time,
)
from omomo_core.learning.synthesis.holds import Handling, Posture
from omomo_core.learning.synthesis.props import ALL, Prop, Stock
from omomo_core.learning.synthesis.walker.footsteps import CHANCES, Chances
from omomo_core.learning.synthesis.walker.improvise import MotionLibrary, improvise

_TRIES = 20
_IMPROVISED = 0.6
"""Share of the base motions that are made to measure; the others are mocap as it was recorded."""


@dataclass(frozen=True)
class Sources:
    """Recorded motion, props and people from which clips are synthesised."""

    footage: Footage
    library: MotionLibrary
    stock: Stock = ALL
    """What can be handled."""


@dataclass(frozen=True)
class MotionRequirements:
    """Requirements on a base motion."""

    frames: int
    pause_frames: list[int]
    """How long the actor must stand still for each thing that happens standing."""
    rate: tuple[float, float] = (0.7, 1.2)
    """How fast recorded walks are played."""
    walk: tuple[int, int] = (24, 10_000)
    """Least and most frames between two stops."""
    backward: float = 0.12
    """Chance that a recorded walk is played backward."""
    moves: Chances | None = None
    """How the actor moves between stops, where that is made up."""
    made_to_measure: bool = False
    """Recorded walks do not suit."""
    way: int = 0
    """1 where the actor mostly walks ahead with the thing, -1 backward, 0 anyhow."""
    comes: bool = True
    """Before the first stop the hands are empty."""
    goes: bool = True
    """After the last stop they are."""


@dataclass(frozen=True)
class ClipPlan:
    """What happens in a clip, before the body is solved for it."""

    base_motion: BaseMotion
    licence: str
    """Licence of the base motion."""
    prop: Prop
    handling: Handling
    posture: Posture
    leant_on: bool
    """The prop stays on the floor, and the body may lean on it or hang back from it."""


def find_base_motion(
    rng: np.random.Generator,
    sources: Sources,
    wanted: MotionRequirements,
    suits: Callable[[BaseMotion], bool] = lambda _: True,
) -> tuple[BaseMotion, str] | None:
    """Find a base motion.

    Args:
        rng: source of all randomness.
        sources: what there is.
        wanted: what is asked for.
        suits: a last word on a base motion that has all that.

    Returns:
        The base motion and its licence; None when none was found.
    """
    for _ in range(_TRIES):
        if wanted.made_to_measure or rng.random() < _IMPROVISED:
            base_motion = improvise(
                rng, sources.library, wanted.frames, wanted.pause_frames, wanted.walk,
                wanted.moves or CHANCES, comes=wanted.comes, goes=wanted.goes,
            )  # fmt: skip
            licence = sources.library.licence
        else:
            base_motion, licence = _recorded(rng, sources.footage, wanted)
        if base_motion is not None and suits(base_motion):
            return base_motion, licence
    return None


def _recorded(
    rng: np.random.Generator, footage: Footage, wanted: MotionRequirements
) -> tuple[BaseMotion | None, str]:
    stretch = footage.stretches[rng.choice(len(footage.stretches), p=footage.chances)]
    if rng.random() < 0.5:
        stretch = mirrored(stretch)
    if rng.random() < wanted.backward:
        stretch = reversed_in_time(stretch)
    base_motion = motion_with_stops(
        rng, stretch, wanted.frames, wanted.pause_frames, wanted.rate, wanted.walk
    )
    return base_motion, stretch.licence
