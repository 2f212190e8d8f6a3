"""The methods of the tables: the recorded people, our generator, GOAL, and those from trained networks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch

from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning, Pose
from omomo_core.generation.generator import generate
from omomo_core.generation.result import GenerationOptions
from omomo_core.generation.sampling.paper import human_motion
from omomo_core.learning.baselines.goal.network import Goal, build
from omomo_core.learning.baselines.goal.rollout import Poses, roll_out, standing
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.method import EvaluatedMethod
from omomo_core.learning.evaluation.methods.published import (
    DEFAULT,
    Omomo,
    Palms,
    SingleStage,
    view_of,
)
from omomo_core.learning.evaluation.truth import recorded_person
from omomo_core.motion import HumanMotion
from omomo_core.stages.network_file import load_network
from omomo_core.stages.stage import Stages, load_stage
from omomo_core.weights.load import load_stages


def load_method(name: str, folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    """Return a method by its name, one of `LOADERS`, from a folder that `omocap train` writes.

    Args:
        name: which; three share the networks of `omocap train omomo`.
        folder: where its networks are.
        options: sampler and steps of those that diffuse.

    Raises:
        AssetError: networks are missing or damaged.
    """
    return LOADERS[name](folder, options)


@dataclass(frozen=True)
class _GoalMethod:
    """GOAL adapted: autoregressive and deterministic; the K samples differ in nothing but where people start.

    With the first frame everybody starts from the recorded pose, and all K are the same person; without
    it they stand in K places around the object.
    """

    network: Goal
    name: str = "GOAL"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """See `EvaluatedMethod`; nothing depends on the seed."""
        view = view_of(clip, 1 if first_frame else samples, first_frame=first_frame)
        first = _first_pose(clip) if first_frame else standing(view, clip.body)
        root, R = roll_out(self.network, view.take, first, clip.body)
        nothing = np.zeros((view.take.frames, 2))
        people = [human_motion(p, q, clip.body, nothing) for p, q in zip(root, R, strict=True)]
        return people * samples if first_frame else people


def _first_pose(clip: RealClip) -> Poses:
    return (
        torch.from_numpy(clip.root[:1]).float(),
        torch.from_numpy(clip.rotations[:1]).float(),
    )


@dataclass(frozen=True)
class _Capture:
    """The `capture` configuration with everything that `omocap run` does after its networks."""

    stages: Stages
    options: GenerationOptions = DEFAULT
    """Sampler and steps."""
    name: str = "omocap"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """See `EvaluatedMethod`."""
        known = (
            Conditioning(start_pose=Pose(clip.root[0], clip.rotations[0]))
            if first_frame
            else UNCONDITIONED
        )
        options = replace(self.options, samples=samples, seed=seed)
        people = generate(clip.motion, clip.body, self.stages, options, _silent, known)
        others = (m for k, m in enumerate(people.motions) if k != people.chosen)
        return [people.motions[people.chosen], *others]


def _silent(step: str, done: float) -> None:
    """Methods do not report their steps."""


class RecordedPeople:
    """The recorded people: the bound of every error, and people's own sliding and collisions."""

    name = "recorded people"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """The recorded person, once."""
        del samples, seed, first_frame
        return [recorded_person(clip, clip.body)]


def _omomo(palms: Palms, folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    hands, body = (load_stage(folder / f"{name}.safetensors") for name in ("hands", "body"))
    return Omomo(hands, body, palms, options)


def _single_stage(folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    return SingleStage(load_stage(folder / "single.safetensors"), options)


def _goal(folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    return _GoalMethod(load_network(folder / "goal.safetensors", build))


def _capture(folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    return _Capture(load_stages("capture", folder), options)


LOADERS: dict[str, Callable[[Path, GenerationOptions], EvaluatedMethod]] = {
    "goal": _goal,
    "single-stage": _single_stage,
    "no-constraints": partial(_omomo, "free"),
    "omomo": partial(_omomo, "constrained"),
    "gt-hands": partial(_omomo, "true"),
    "capture": _capture,
}
