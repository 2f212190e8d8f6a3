"""GOAL adapted, as a method of the tables."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from omomo_core.generation.sampling.paper import human_motion
from omomo_core.learning.baselines.goal.network import Goal
from omomo_core.learning.baselines.goal.rollout import Poses, roll_out, standing
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.methods.published import view_of
from omomo_core.motion import HumanMotion


@dataclass(frozen=True)
class GoalMethod:
    """Autoregressive and deterministic: the K samples differ in nothing but where people start.

    With the first frame everybody starts from the recorded pose, and all K are the same person; without
    it they stand in K places around the object.
    """

    network: Goal
    name: str = "GOAL"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """See `Method`; nothing depends on the seed."""
        view = view_of(clip, 1 if first_frame else samples, first_frame=first_frame)
        first = _recorded(clip) if first_frame else standing(view, clip.body)
        root, R = roll_out(self.network, view.take, first, clip.body)
        nothing = np.zeros((view.take.frames, 2))
        people = [human_motion(p, q, clip.body, nothing) for p, q in zip(root, R, strict=True)]
        return people * samples if first_frame else people


def _recorded(clip: RealClip) -> Poses:
    return (
        torch.from_numpy(clip.root[:1]).float(),
        torch.from_numpy(clip.rotations[:1]).float(),
    )
