"""Options and results of a generation, and the prefix by which chunks share their state."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.contact.segment import ContactSegment
from omomo_core.diffusion.samplers import Sampler
from omomo_core.generation.generation_config import PREFIX
from omomo_core.generation.person import Person
from omomo_core.motion import HumanMotion

Progress = Callable[[str, float], None]
"""Progress callback: name of the step, fraction done."""


def no_progress(step: str, fraction: float) -> None:
    """Ignore the progress."""


@dataclass(frozen=True)
class GenerationOptions:
    """Options of the generator: samples, seed, contact rule, sampler and its steps."""

    samples: int = 4
    seed: int = 0
    contact: Literal["segments", "paper"] = "segments"
    sampler: Sampler = "dpm++"
    steps: int = 7
    solve: Literal["shown", "all"] = "all"
    """Whether only the sample that is shown is solved, or every one."""


@dataclass(frozen=True)
class Generation:
    """K samples with their scores."""

    people: tuple[Person, ...]
    chosen: int
    """Index of the sample to show: central among the samples, with few faults."""
    scores: tuple[dict[str, float], ...]
    notes: tuple[str, ...]
    """Faults of the chosen sample, in sentences."""
    unsolved: frozenset[int] = frozenset()
    """Indices of samples that are as they were sampled: palms may miss, and fingers are straight."""

    @property
    def motions(self) -> tuple[HumanMotion, ...]:
        """The samples' bodies."""
        return tuple(person.human for person in self.people)


def notes_of(scores: dict[str, float]) -> tuple[str, ...]:
    """Return the faults of a sample that its user should know of, in sentences."""
    faults = (
        (
            "unheld",
            0.05,
            "no hand is on the object in {:.0%} of the frames in which it must be held",
        ),
        ("miss_cm", 1.0, "the palms miss the object by {:.1f} cm on average while holding it"),
        ("inside_cm", 1.0, "the body without hands is {:.1f} cm inside the object on average"),
        ("hands_inside_cm", 1.0, "holding hands are {:.1f} cm inside the object on average"),
        ("wrists_beyond", 0.1, "holding wrists are bent too far in {:.0%} of the frames"),
    )
    return tuple(text.format(scores[key]) for key, limit, text in faults if scores[key] > limit)


@dataclass(frozen=True)
class FeaturePrefix:
    """Features of the first frames that are fixed (raw units, world axes)."""

    values: Float[Tensor, "samples first channels"]
    mask: Bool[Tensor, " channels"]
    """Which features are fixed."""
    fade: int = PREFIX.fade
    """Frames over which they pull on those after them."""

    @staticmethod
    def all(values: Float[Tensor, "samples first channels"]) -> "FeaturePrefix":
        """Return a prefix in which all features are fixed."""
        return FeaturePrefix(values, torch.ones(values.shape[-1], dtype=torch.bool))

    def impose(
        self, x: Float[Tensor, "samples frames channels"]
    ) -> Float[Tensor, "samples frames channels"]:
        """Return `x` with the prefix in its first frames; the change of its last frame fades out after it."""
        first = self.values.shape[1]
        change = torch.where(self.mask, self.values - x[:, :first], 0.0)
        rest = fade(x.shape[1] - first + 1, self.fade).to(x)[1:, None] * change[:, -1:]
        return x + torch.cat([change, rest], dim=1)


@dataclass(frozen=True)
class Prefix:
    """The fixed first frames of a chunk, as each sample has them before it is solved."""

    hands: FeaturePrefix | None
    """Features of stage 1; None where palms are given."""
    body: FeaturePrefix
    """Features of stage 2, with the root in the networks' world instead of relative to the reference path."""
    palms: Float[np.ndarray, "samples first 2 3"]
    segments: Sequence[tuple[ContactSegment, ...]]
    """Contact segments of each sample in these frames; an empty list where contacts are not fixed."""

    @property
    def frames(self) -> int:
        """How many frames are fixed."""
        return self.palms.shape[1]


@dataclass(frozen=True)
class SolvedPrefix:
    """The solved bodies in the fixed first frames of a chunk."""

    root: Float[Tensor, "samples first 3"]
    """Pelvis, world, metres."""
    rotations: Float[Tensor, "samples first 22 3 3"]
    standing: Bool[np.ndarray, "samples first 2"]
    fingers: Float[Tensor, "samples first 30 3 3"] | None = None
    """Relative to their parents; None where they are not known."""

    def select(self, some: slice) -> "SolvedPrefix":
        """Return that of some samples."""
        fingers = None if self.fingers is None else self.fingers[some]
        return SolvedPrefix(self.root[some], self.rotations[some], self.standing[some], fingers)

    @property
    def frames(self) -> int:
        """How many frames are fixed."""
        return self.root.shape[1]


def fade(frames: int, until: int = PREFIX.fade) -> Float[Tensor, " frames"]:
    """Return weights from 1 at the first frame, smoothly to 0 at frame `until`."""
    t = (torch.arange(frames) / until).clamp(max=1)
    return 1 - t * t * (3 - 2 * t)


def free_after(first: int, frames: int) -> Float[Tensor, " frames"]:
    """Return how far frames may be changed: 0 in the first ones, then smoothly up to 1."""
    if not first:
        return torch.ones(frames)
    return torch.cat([torch.zeros(first - 1), 1 - fade(frames - first + 1)])
