"""OMOMO and its variants as published (sections 3 and 5.1), trained by `omocap train`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch

from omomo_core.generation.conditioning import Pose
from omomo_core.generation.result import GenerationOptions
from omomo_core.generation.sampling.paper import (
    PersonView,
    bodies_from_object,
    bodies_from_palms,
    sample_palms,
    views_around,
    views_from_pose,
)
from omomo_core.geometry.object_features import object_features
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.stages.hands.contact_rule import constrain
from omomo_core.stages.stage import Stage

Palms = Literal["constrained", "free", "true"]
"""By the contact rule; as the first network says; of the recorded person."""
DEFAULT = GenerationOptions()
NAMES: dict[Palms, str] = {
    "constrained": "OMOMO",
    "free": "OMOMO without contact constraints",
    "true": "OMOMO with ground-truth hands",
}


def view_of(clip: RealClip, samples: int, *, first_frame: bool) -> PersonView:
    """Where each sample's person stands: as the recorded one, or around the object."""
    take = object_features(clip.motion)
    if first_frame:
        return views_from_pose(take, Pose(clip.root[0], clip.rotations[0]), samples)
    return views_around(take, samples)


@dataclass(frozen=True)
class Omomo:
    """Two networks, with the palms between them."""

    hands: Stage
    body: Stage
    palms: Palms = "constrained"
    options: GenerationOptions = DEFAULT
    """Sampler and steps; the paper's are 1,000 of "ddpm"."""

    @property
    def name(self) -> str:
        """As the tables call it."""
        return NAMES[self.palms]

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """See `EvaluatedMethod`."""
        view = view_of(clip, samples, first_frame=first_frame)
        generator = torch.Generator().manual_seed(seed)
        hands = self._hands(clip, view, generator)
        return bodies_from_palms(
            view, hands, clip.body, self.body, self.options, generator, _silent
        )

    def _hands(
        self, clip: RealClip, view: PersonView, generator: torch.Generator
    ) -> list[HandMotion]:
        if self.palms == "true":
            return [_untouching(clip.joints[:, 22:])] * len(view.yaw)
        drawn = sample_palms(view, self.hands, self.options, generator, _silent)
        if self.palms == "free":
            return [_untouching(palms) for palms in drawn]
        mesh, T = clip.motion.mesh, clip.motion.T_world_object
        return [constrain(palms, mesh.vertices, T) for palms in drawn]


@dataclass(frozen=True)
class SingleStage:
    """One network, from the object to the body."""

    stage: Stage
    options: GenerationOptions = DEFAULT
    name: str = "OMOMO single-stage"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """See `EvaluatedMethod`."""
        view = view_of(clip, samples, first_frame=first_frame)
        generator = torch.Generator().manual_seed(seed)
        return bodies_from_object(view, clip.body, self.stage, self.options, generator, _silent)


def _untouching(palms: np.ndarray) -> HandMotion:
    return HandMotion(palms=palms, contact=np.zeros(palms.shape[:2]))


def _silent(done: float) -> None:
    """Methods do not report their steps."""
