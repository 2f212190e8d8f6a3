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

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.opposite_side import add_opposite_side, move_to_lighter_side
from omomo_core.generation.selection.plausibility import Hypotheses, PalmHolds, Samples
from omomo_core.stages.hands.capture import LAYOUT

PER_SAMPLE, MOST = 5, 100
"""Guesses for each that is kept, and at most."""
STRIDE = 4
"""Frames between those that are compared."""
NEIGHBOURS, KERNEL_WIDTH = 5, 0.25
"""Guesses that are much of a kind, unless their palms are farther apart than so many metres."""
CONTACT_DISTANCE = 0.5
"""Metres apart that guesses count as for each hand that holds in one of them only."""
KERNEL_SMOOTHING = 15.0
"""Frames (standard deviation) over which guesses are compared to tell their kind."""


def select_by_coverage(features: Hypotheses, clip: ObjectClip, samples: int) -> Samples:
    """Guesses that stand for all; who would lift the heavy side changes sides, and the last are opposite.

    Those that hold the object as nobody would are left out, unless too few others are left.

    Args:
        features: of all guesses, palms from the object's centre in axes whose third is up, contacts.
        clip: the object.
        samples: how many to keep.
    """
    x = move_to_lighter_side(features, clip)
    likely = np.flatnonzero(PalmHolds.of(x, clip).plausible)
    if len(likely) >= samples:
        x = x[torch.from_numpy(likely)]
    kept = torch.from_numpy(k_medoids(_palms(x), samples))
    return add_opposite_side(kernel_mean(x)[kept], clip)


def kernel_mean(features: Samples) -> Samples:
    """Each guess amid those that are most like it, and so nearer to what they all guess.

    A guess errs in what all of its kind agree on and in what nobody can tell; the mean of its kind hardly in
    the latter. Who is of a kind is seen anew all along the take.
    """
    palms, holds = _palms(features), (features[..., 3 * LAYOUT.vectors :] > 0).double().numpy()
    x: list[Tensor] = []
    for one, held in zip(palms, holds, strict=True):
        apart = np.linalg.norm(palms - one, axis=-1).mean(axis=-1)
        apart += CONTACT_DISTANCE * np.abs(holds - held).sum(axis=-1)
        apart = np.asarray(gaussian_filter1d(apart, KERNEL_SMOOTHING, axis=-1, mode="nearest"))
        kind = np.sort(apart, axis=0)[: min(NEIGHBOURS, len(apart))][-1].clip(1e-6, KERNEL_WIDTH)
        weight = np.exp(-((apart / kind) ** 2))
        weight = torch.from_numpy(weight / weight.sum(axis=0)).to(features)
        x.append((weight[..., None] * features).sum(dim=0))
    return torch.stack(x)


def order_by_side(features: Samples) -> Samples:
    """The same samples in the order of the side from which they hold the object: neighbours are alike."""
    held = (features[..., 3 * LAYOUT.vectors :] > 0).any(dim=-1, keepdim=True)
    middle = features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).mean(dim=-2)
    side = (middle * held).sum(dim=-2)
    return features[torch.atan2(side[:, 1], side[:, 0]).argsort(stable=True)]


def hypothesis_count(samples: int) -> int:
    """How many to draw where so many are kept."""
    return max(samples, min(PER_SAMPLE * samples, MOST))


def k_medoids(
    palms: Float[np.ndarray, "hypotheses frames 2 3"], samples: int
) -> Int[np.ndarray, " samples"]:
    """Indices of the guesses to keep, the most telling first.

    Each lowers most the sum, over all guesses, of the mean distance between the palms of a guess and
    those of the nearest that is kept.

    Args:
        palms: metres, in any axes that all guesses share.
        samples: how many to keep.
    """
    apart = _pairwise_distance(palms)
    kept: list[int] = []
    nearest = np.full(len(palms), np.inf)
    for _ in range(samples):
        left = np.minimum(nearest, apart).sum(axis=1)
        left[kept] = np.inf
        kept.append(int(left.argmin()))
        nearest = np.minimum(nearest, apart[kept[-1]])
    return np.array(kept)


def _pairwise_distance(
    palms: Float[np.ndarray, "hypotheses frames 2 3"],
) -> Float[np.ndarray, "hypotheses hypotheses"]:
    """Mean distance between the palms of any two guesses, metres."""
    seen = palms[:, ::STRIDE]
    return np.stack([np.linalg.norm(seen - one, axis=-1).mean(axis=(1, 2)) for one in seen])


def _palms(features: Samples) -> Float[np.ndarray, "samples frames 2 3"]:
    return features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).double().numpy()
