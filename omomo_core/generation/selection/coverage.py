"""Some of many guesses that stand for all of them.

Guesses of the palms are cheap and bodies are not: more are drawn than bodies are made, and those kept
are the ones around which the others lie (greedy facility location), each the mean of its kind. One alone
is that of the medoid.
"""

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.generation.object_clip import Scene
from omomo_core.generation.selection.opposite_side import on_lighter_side, with_opposite
from omomo_core.generation.selection.plausibility import Holding
from omomo_core.stages.hands.capture import LAYOUT

DRAWN, MOST = 5, 100
"""Guesses for each that is kept, and at most."""
STRIDE = 4
"""Frames between those that are compared."""
KIND, ALIKE = 5, 0.25
"""Guesses that are much of a kind, unless their palms are farther apart than so many metres."""
HAND = 0.5
"""Metres apart that guesses count as for each hand that holds in one of them only."""
A_WHILE = 15.0
"""Frames (standard deviation) over which guesses are compared to tell their kind."""
Guesses = Float[Tensor, "guesses frames 8"]
Samples = Float[Tensor, "samples frames 8"]


def of_many(features: Guesses, scene: Scene, samples: int) -> Samples:
    """Guesses that stand for all; who would lift the heavy side changes sides, and the last are opposite.

    Those that hold the object as nobody would are left out, unless too few others are left.

    Args:
        features: of all guesses, palms from the object's centre in axes whose third is up, contacts.
        scene: the object.
        samples: how many to keep.
    """
    x = on_lighter_side(features, scene)
    likely = np.flatnonzero(Holding.of(x, scene).likely)
    if len(likely) >= samples:
        x = x[torch.from_numpy(likely)]
    kept = torch.from_numpy(cover(_palms(x), samples))
    return with_opposite(amid_others(x)[kept], scene)


def amid_others(features: Samples) -> Samples:
    """Each guess amid those that are most like it, and so nearer to what they all guess.

    A guess errs in what all of its kind agree on and in what nobody can tell; the mean of its kind hardly in
    the latter. Who is of a kind is seen anew all along the take.
    """
    palms, holds = _palms(features), (features[..., 3 * LAYOUT.vectors :] > 0).double().numpy()
    x: list[Tensor] = []
    for one, held in zip(palms, holds, strict=True):
        apart = np.linalg.norm(palms - one, axis=-1).mean(axis=-1)
        apart += HAND * np.abs(holds - held).sum(axis=-1)
        apart = np.asarray(gaussian_filter1d(apart, A_WHILE, axis=-1, mode="nearest"))
        kind = np.sort(apart, axis=0)[: min(KIND, len(apart))][-1].clip(1e-6, ALIKE)
        weight = np.exp(-((apart / kind) ** 2))
        weight = torch.from_numpy(weight / weight.sum(axis=0)).to(features)
        x.append((weight[..., None] * features).sum(dim=0))
    return torch.stack(x)


def around(features: Samples) -> Samples:
    """The same samples in the order of the side from which they hold the object: neighbours are alike."""
    held = (features[..., 3 * LAYOUT.vectors :] > 0).any(dim=-1, keepdim=True)
    middle = features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).mean(dim=-2)
    side = (middle * held).sum(dim=-2)
    return features[torch.atan2(side[:, 1], side[:, 0]).argsort(stable=True)]


def guesses(samples: int) -> int:
    """How many to draw where so many are kept."""
    return max(samples, min(DRAWN * samples, MOST))


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
    apart = _apart(palms)
    kept: list[int] = []
    nearest = np.full(len(palms), np.inf)
    for _ in range(samples):
        left = np.minimum(nearest, apart).sum(axis=1)
        left[kept] = np.inf
        kept.append(int(left.argmin()))
        nearest = np.minimum(nearest, apart[kept[-1]])
    return np.array(kept)


def _apart(palms: Float[np.ndarray, "guesses frames 2 3"]) -> Float[np.ndarray, "guesses guesses"]:
    """Mean distance between the palms of any two guesses, metres."""
    seen = palms[:, ::STRIDE]
    return np.stack([np.linalg.norm(seen - one, axis=-1).mean(axis=(1, 2)) for one in seen])


def _palms(features: Samples) -> Float[np.ndarray, "samples frames 2 3"]:
    return features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).double().numpy()
