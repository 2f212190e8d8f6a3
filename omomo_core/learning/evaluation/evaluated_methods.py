"""The methods of the tables behind one interface: the recorded people, ours, GOAL, and those of the paper."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np
import torch

from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning, Pose
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.generation.paper_generator import (
    PersonView,
    bodies_from_object,
    bodies_from_palms,
    human_motion,
    sample_palms,
    views_around,
    views_from_pose,
)
from omomo_core.geometry.object_features import object_features
from omomo_core.learning.baselines.goal import Goal, Poses, build, roll_out, standing
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.evaluation.truth import recorded_person
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.stages.hands_paper import constrain
from omomo_core.stages.network_file import load_network
from omomo_core.stages.stage import Stage, Stages, load_stage
from omomo_core.weights.load import load_stages

Palms = Literal["constrained", "free", "true"]
"""Palms by the contact rule; as the first network says; of the recorded person."""


def view_of(clip: RealClip, samples: int, *, first_frame: bool) -> PersonView:
    """Return the angle at which each sample's person stands: as the recorded one, or around the object."""
    take = object_features(clip.motion)
    if first_frame:
        return views_from_pose(take, Pose(clip.root[0], clip.rotations[0]), samples)
    return views_around(take, samples)


@dataclass(frozen=True)
class Omomo:
    """Two networks, with the palms between them."""

    hands: Stage
    body: Stage
    palms: Palms
    options: GenerationOptions
    """Sampler and steps; the paper's are 1,000 of "ddpm"."""

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
    options: GenerationOptions

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


@runtime_checkable
class EvaluatedMethod(Protocol):
    """A way to make people for a moving object."""

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """People on the bones of the clip's body, in the world; the one that it would show comes first.

        Args:
            clip: one window of 24 to 120 frames; of its truth a method uses only what its name says.
            samples: how many people (K).
            seed: of all randomness.
            first_frame: the true pose of frame 0, and the canonical frame it gives, may be used (the
                paper's protocol, OMOMO section 5.1).
        """
        ...


@dataclass(frozen=True)
class _GoalMethod:
    """GOAL adapted: autoregressive and deterministic; the K samples differ in nothing but where people start.

    With the first frame everybody starts from the recorded pose, and all K are the same person; without
    it they stand in K places around the object.
    """

    network: Goal

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
    options: GenerationOptions
    """Sampler and steps."""

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
        people = generate(clip.motion, clip.body, self.stages, options, conditioning=known)
        others = (m for k, m in enumerate(people.motions) if k != people.chosen)
        return [people.motions[people.chosen], *others]


class RecordedPeople:
    """The recorded people: the bound of every error, and people's own sliding and collisions."""

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
"""Methods by their names, each from the folder of its networks, as `omocap train` writes it. An `AssetError`
says that networks are missing or damaged; the options are sampler and steps of those that diffuse."""
