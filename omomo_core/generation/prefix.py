"""Prefix: the fixed first frames of a chunk, by the chunk before it or by a start pose."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.config import PREFIX


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
