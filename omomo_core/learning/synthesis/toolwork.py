"""One try at somebody's work with a tool or with something on wheels."""

from typing import get_args

import numpy as np

from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.casting import ClipPlan, Sources, Wanted, cast
from omomo_core.learning.synthesis.holds import Handling
from omomo_core.learning.synthesis.posture import Posture
from omomo_core.learning.synthesis.props import Stock, make_prop, scaled
from omomo_core.learning.synthesis.stage import StagedMotion
from omomo_core.learning.synthesis.tools.cart import direct_cart
from omomo_core.learning.synthesis.tools.job import PROPS, ToolAction, write_job
from omomo_core.learning.synthesis.tools.strokes import direct_strokes
from omomo_core.learning.synthesis.tools.trolley import direct_trolley
from omomo_core.learning.synthesis.walker.path import Chances

_PROP_TRIES = 60
_DIRECTORS = {"trolley": direct_trolley, "cart": direct_cart}
_STROLL: Chances = {"walk": 0.3, "shuffle": 0.4, "side": 0.15, "back": 0.15}
_AHEAD: Chances = {"walk": 1.0}
TOOL_ACTIONS: tuple[ToolAction, ...] = get_args(ToolAction)


def work(
    rng: np.random.Generator, sources: Sources, action: ToolAction, body: BodyModel, scale: float
) -> ClipPlan | str:
    """Somebody at work, before the body is solved, or why it is no good."""
    frames = int(rng.uniform(120, 300))
    rolls = action in _DIRECTORS
    tools = Stock(frozenset({PROPS[action]}))
    for _ in range(_PROP_TRIES):
        prop = scaled(make_prop(rng, "push" if rolls else "tool", tools), scale)
        job = write_job(rng, action, prop, frames)
        if job is not None and sum(job.pause_frames) < frames - 40:
            break
    else:
        return "no-prop"
    wanted = Wanted(
        frames,
        job.pause_frames,
        rate=(0.6, 1.0) if rolls else (0.4, 0.7),
        backward=0.3 if action == "cart" else 0.0,
        moves=_AHEAD if rolls else _STROLL,
    )
    director, handlings = _DIRECTORS.get(action, direct_strokes), list[Handling]()

    def suits(stage: StagedMotion) -> bool:
        handling = director(rng, body, stage, job)
        handlings.extend([handling] if handling is not None else [])
        return handling is not None

    found = cast(rng, sources, wanted, suits)
    if found is None:
        return "no-way"
    handling = handlings[-1]
    posture = Posture(squat=rng.uniform(0.0, 0.5), lean=rng.uniform(0.0, 0.2))
    return ClipPlan(*found, prop, handling, posture, leant_on=rolls)
