"""Samples in which the person stands on the opposite side of the object.

A hypothesis given half a turn about the vertical through the object's centre keeps the left hand left and
the right hand right, and is as good wherever the object has a surface there too. Where the object stands
on an edge, its weight tells the side. Elsewhere the object's motion does not always tell it, and the network
is more certain than it is right.
"""

import numpy as np
import torch

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.config import OPPOSITE_SIDE
from omomo_core.generation.selection.plausibility import PalmHolds, Samples

_HALF_TURN = torch.tensor([-1.0, -1.0, 1.0]).repeat(2)


def move_to_lighter_side(features: Samples, clip: ObjectClip) -> Samples:
    """Return the samples; one that tips the object from its heavy side is moved to the opposite side.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts.
        clip: the object.
    """
    if clip.lever is None:
        return features
    away = half_turn(features)
    here, there = PalmHolds.of(features, clip), PalmHolds.of(away, clip)
    heavy = there.effort < OPPOSITE_SIDE.lighter * here.effort
    change = heavy & there.as_good_as(here) if heavy.any() else heavy
    return torch.where(torch.from_numpy(change)[:, None, None], away, features)


def add_opposite_side(features: Samples, clip: ObjectClip) -> Samples:
    """Return the samples with the last of them replaced by the first, seen from the opposite side.

    Args:
        features: as above, the most central first.
        clip: the object.
    """
    away = half_turn(features)
    here, there = PalmHolds.of(features, clip), PalmHolds.of(away, clip)
    possible = there.as_good_as(here)
    if clip.lever is not None:
        possible &= ~(here.effort < OPPOSITE_SIDE.lighter * there.effort)
    changed = np.flatnonzero(possible)[: len(features) // OPPOSITE_SIDE.one_in]
    return torch.cat([features[: len(features) - len(changed)], away[changed]])


def half_turn(features: Samples) -> Samples:
    """Return the samples half a turn about the vertical through the object's centre."""
    away = features.clone()
    away[..., : len(_HALF_TURN)] *= _HALF_TURN
    return away
