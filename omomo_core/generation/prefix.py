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
    """The fixed first frames of a chunk, of each sample."""

    hands: FeaturePrefix | None
    """Features of stage 1; None where palms are given."""
    body: FeaturePrefix
    """Features of stage 2, with the root in the networks' world instead of relative to the reference path."""
    root: Float[Tensor, "samples first 3"]
    """Pelvis of the solved body, world, metres."""
    rotations: Float[Tensor, "samples first 22 3 3"]
    palms: Float[np.ndarray, "samples first 2 3"]
    standing: Bool[np.ndarray, "samples first 2"]
    segments: Sequence[tuple[ContactSegment, ...]]
    """Contact segments of each sample in these frames; an empty list where contacts are not fixed."""

    fingers: Float[Tensor, "samples first 30 3 3"] | None = None
    """Of the solved body; None where they are not known."""

    @property
    def frames(self) -> int:
        """How many frames are fixed."""
        return self.root.shape[1]


def fade(frames: int, until: int = PREFIX.fade) -> Float[Tensor, " frames"]:
    """Return weights from 1 at the first frame, smoothly to 0 at frame `until`."""
    t = (torch.arange(frames) / until).clamp(max=1)
    return 1 - t * t * (3 - 2 * t)
