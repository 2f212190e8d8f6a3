"""Networks of each method that can be trained, with their default steps and learning rates."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal

from omomo_core.geometry.object_features import PAPER_POINTS
from omomo_core.learning.baselines import goal
from omomo_core.learning.baselines.goal import GoalTraining
from omomo_core.learning.training.denoising import Denoising
from omomo_core.learning.training.training_task import Make
from omomo_core.stages import body_capture, body_paper
from omomo_core.stages import hands_capture as hand_capture
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.body_paper import CHANNELS
from omomo_core.stages.stage import StageConfig
from omomo_core.stages.stage_config import Size, paper_stage_config

MethodName = Literal["capture", "omomo", "single-stage", "goal"]
SHIPPED_STEPS = {"hands": 20_000, "body": 11_000}
"""Training steps of the weights that ship; more steps give better networks."""
PAPER_STEPS: dict[Size, int] = {"published": 400_000, "laptop": 8_000}


@dataclass(frozen=True)
class NetworkPlan:
    """One network of a method."""

    make: Make
    steps: int
    """Training steps, by default."""
    rate: float
    """Peak learning rate, by default."""
    objects: bool
    """Whether it needs clips with objects."""


def networks(method: MethodName, size: Size) -> Mapping[str, NetworkPlan]:
    """The networks of a method by the names of their files, in the order they are trained.

    `capture` has one size, which is a laptop's already.
    """
    if method == "capture":
        hands, body = hand_capture.CONFIG, body_capture.CONFIG
        return {
            "hands": NetworkPlan(
                partial(Denoising, hands), SHIPPED_STEPS["hands"], 1e-3, objects=True
            ),
            "body": NetworkPlan(
                partial(Denoising, body), SHIPPED_STEPS["body"], 1e-3, objects=False
            ),
        }
    # The paper's rate is for its width; the smaller trunk bears a larger one.
    rate = 2e-4 if size == "published" else 1e-3
    makes: dict[MethodName, dict[str, Make]] = {
        "omomo": {
            "hands": partial(Denoising, hand_paper.config(size)),
            "body": partial(Denoising, body_paper.config(size)),
        },
        "single-stage": {"single": partial(Denoising, single_stage_config(size))},
        "goal": {"goal": partial(GoalTraining, goal.config(size))},
    }
    return {
        name: NetworkPlan(make, PAPER_STEPS[size], rate, objects=True)
        for name, make in makes[method].items()
    }


def single_stage_config(size: Size) -> StageConfig:
    """Return the network of the paper's "OMOMO-single-stage" (section 5.1): from object to body, no palms.

    Its condition is that of the first stage (object centre and BPS), its output that of the second (204
    numbers).
    """
    return paper_stage_config(
        "single", size, channels=CHANNELS, condition=3, shape=3 * PAPER_POINTS
    )
