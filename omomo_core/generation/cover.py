"""Some of many guesses that stand for all of them.

Guesses of the palms are cheap and bodies are not: more are drawn than bodies are made, and those kept
are the ones around which the others lie (greedy facility location). One alone is the medoid.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.generation.opposite import on_lighter_side, with_opposite
from omomo_core.generation.scene import Scene
from omomo_core.hand_stage.capture import LAYOUT

DRAWN, FEWEST, MOST = 3, 8, 100
"""Guesses for each that is kept; at least and at most."""
STRIDE = 4
"""Frames between those that are compared."""
Samples = Float[Tensor, "samples frames 8"]


@dataclass(frozen=True)
class OfMany:
    """Guesses that stand for all; who would lift the heavy side changes sides, and the last are opposite."""

    kept: Int[Tensor, " samples"]
    """Which."""
    scene: Scene

    @staticmethod
    def choose(features: Samples, scene: Scene, samples: int) -> "OfMany":
        """Which of all guesses to keep."""
        x = on_lighter_side(features, scene)
        palms = x[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3))
        return OfMany(torch.from_numpy(cover(palms.double().numpy(), samples)), scene)

    def finished(self, features: Samples) -> Samples:
        """The guesses that are kept, once they are drawn to the end, from their sides."""
        return with_opposite(on_lighter_side(features, self.scene), self.scene)


def guesses(samples: int) -> int:
    """How many to draw where so many are kept."""
    return max(samples, min(max(DRAWN * samples, FEWEST), MOST))


def cover(
    palms: Float[np.ndarray, "guesses frames 2 3"], samples: int
) -> Int[np.ndarray, " samples"]:
    """Indices of the guesses to keep, the most telling first.

    Each lowers most the sum, over all guesses, of the mean distance between the palms of a guess and
    those of the nearest that is kept.

    Args:
        palms: metres, in any axes that all guesses share.
        samples: how many to keep.
    """
    seen = palms[:, ::STRIDE]
    apart = np.stack([np.linalg.norm(seen - one, axis=-1).mean(axis=(1, 2)) for one in seen])
    kept: list[int] = []
    nearest = np.full(len(palms), np.inf)
    for _ in range(samples):
        left = np.minimum(nearest, apart).sum(axis=1)
        left[kept] = np.inf
        kept.append(int(left.argmin()))
        nearest = np.minimum(nearest, apart[kept[-1]])
    return np.array(kept)
