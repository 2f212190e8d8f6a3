"""The first frames of a chapter that are decided: by the chapter before it, or by a pose that is known."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.contact.segment import ContactSegment

FADE = 20
"""Frames over which what is decided pulls on those after it."""


@dataclass(frozen=True)
class FeaturePrefix:
    """Features of the first frames that are given (raw units, world axes)."""

    values: Float[Tensor, "samples first channels"]
    mask: Bool[Tensor, " channels"]
    fade: int = FADE
    """Frames over which they pull on those after them."""

    @staticmethod
    def all(values: Float[Tensor, "samples first channels"]) -> "FeaturePrefix":
        """All features given."""
        return FeaturePrefix(values, torch.ones(values.shape[-1], dtype=torch.bool))

    def impose(
        self, x: Float[Tensor, "samples frames channels"]
    ) -> Float[Tensor, "samples frames channels"]:
        """The first frames as given; what that changes in the last of them fades out after it."""
        first = self.values.shape[1]
        change = torch.where(self.mask, self.values - x[:, :first], 0.0)
        rest = fade(x.shape[1] - first + 1, self.fade).to(x)[1:, None] * change[:, -1:]
        return x + torch.cat([change, rest], dim=1)


@dataclass(frozen=True)
class Prefix:
    """Of each sample, in the first frames of a chapter."""

    hands: FeaturePrefix | None
    """Stage 1's features; None where palms are given."""
    body: FeaturePrefix
    """Stage 2's features, with the root in the networks' world instead of the reference path's."""
    root: Float[Tensor, "samples first 3"]
    """Pelvis of the finished body, world, metres."""
    rotations: Float[Tensor, "samples first 22 3 3"]
    palms: Float[np.ndarray, "samples first 2 3"]
    standing: Bool[np.ndarray, "samples first 2"]
    segments: Sequence[tuple[ContactSegment, ...]]
    """What each hand holds in these frames, of each sample; none at all where that is open."""

    @property
    def frames(self) -> int:
        """How many are decided."""
        return self.root.shape[1]


def fade(frames: int, until: int = FADE) -> Float[Tensor, " frames"]:
    """1 at the first frame, smoothly to 0."""
    t = (torch.arange(frames) / until).clamp(max=1)
    return 1 - t * t * (3 - 2 * t)
