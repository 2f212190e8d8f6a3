"""Selection of the samples that cover many palm hypotheses: greedy k-medoids, each moved to its kernel mean.

Hypotheses of the palms are cheap and bodies are not, so more of them are sampled than bodies are made. A
single sample is the medoid of all hypotheses.
"""

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.config import COVERAGE
from omomo_core.generation.selection.opposite_side import add_opposite_side, move_to_lighter_side
from omomo_core.generation.selection.plausibility import Hypotheses, PalmHolds, Samples
from omomo_core.stages.hands.capture import LAYOUT


def select_by_coverage(features: Hypotheses, clip: ObjectClip, samples: int) -> Samples:
    """Return the samples that cover all hypotheses best (k-medoids), some of them from the opposite side.

    A hypothesis that would lift the heavy side of a tipped object changes sides first. Implausible
    hypotheses are left out, unless too few others are left.

    Args:
        features: of all hypotheses, in axes whose third is up.
        clip: the object.
        samples: how many to keep.
    """
    x = move_to_lighter_side(features, clip)
    plausible = np.flatnonzero(PalmHolds.of(x, clip).plausible)
    if len(plausible) >= samples:
        x = x[torch.from_numpy(plausible)]
    kept = torch.from_numpy(k_medoids(_palms(x), samples))
    return add_opposite_side(kernel_mean(x)[kept], clip)


def kernel_mean(features: Samples) -> Samples:
    """Return the kernel mean at each hypothesis, frame by frame: the average of those near it.

    A hypothesis errs in what all of its kind agree on and in what nobody can tell; their mean hardly errs
    in the latter. The width of the kernel follows the distance to the nearest hypotheses in each frame.
    """
    palms, holds = _palms(features), (features[..., 3 * LAYOUT.vectors :] > 0).double().numpy()
    x: list[Tensor] = []
    for one, held in zip(palms, holds, strict=True):
        apart = np.linalg.norm(palms - one, axis=-1).mean(axis=-1)
        apart += COVERAGE.contact_distance * np.abs(holds - held).sum(axis=-1)
        apart = np.asarray(
            gaussian_filter1d(apart, COVERAGE.kernel_smoothing, axis=-1, mode="nearest")
        )
        width = np.sort(apart, axis=0)[: min(COVERAGE.neighbours, len(apart))][-1].clip(
            1e-6, COVERAGE.kernel_width
        )
        weight = np.exp(-((apart / width) ** 2))
        weight = torch.from_numpy(weight / weight.sum(axis=0)).to(features)
        x.append((weight[..., None] * features).sum(dim=0))
    return torch.stack(x)


def order_by_side(features: Samples) -> Samples:
    """Return the samples in the order of the side from which they hold the object: neighbours are alike."""
    held = (features[..., 3 * LAYOUT.vectors :] > 0).any(dim=-1, keepdim=True)
    middle = features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).mean(dim=-2)
    side = (middle * held).sum(dim=-2)
    return features[torch.atan2(side[:, 1], side[:, 0]).argsort(stable=True)]


def hypothesis_count(samples: int) -> int:
    """Return how many hypotheses to sample where so many samples are kept."""
    return max(samples, min(COVERAGE.hypotheses_per_sample * samples, COVERAGE.most_hypotheses))


def k_medoids(
    palms: Float[np.ndarray, "hypotheses frames 2 3"], samples: int
) -> Int[np.ndarray, " samples"]:
    """Return the indices of the hypotheses to keep, the most central first (greedy k-medoids).

    Each one lowers most the sum, over all hypotheses, of the mean distance between the palms of a
    hypothesis and those of the nearest that is kept.

    Args:
        palms: metres, in any axes that all hypotheses share.
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
    """Return the mean distance between the palms of any two hypotheses, metres."""
    seen = palms[:, :: COVERAGE.stride]
    return np.stack([np.linalg.norm(seen - one, axis=-1).mean(axis=(1, 2)) for one in seen])


def _palms(features: Samples) -> Float[np.ndarray, "samples frames 2 3"]:
    return features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).double().numpy()
