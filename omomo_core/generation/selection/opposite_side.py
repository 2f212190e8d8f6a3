"""Samples in which the person stands on the other side.

A guess given half a turn about the upright line through the object's centre keeps the left hand left and
the right hand right, and is as good wherever the object has a surface there too. Where the object stands
on an edge, its weight tells which side is the right one. Where it does not, nobody can always tell from
how a thing moves which side it was moved from, and the network is surer than it is right. The other side
of a chair's back is another matter: there the hands are where they were, the left where the right was.
"""

import numpy as np
import torch
from scipy.ndimage import gaussian_filter1d

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.plausibility import PalmHolds, Samples

ONE_IN = 5
"""One of so many samples changes sides."""
LIGHTER = 0.9
"""Where holding up what is tipped takes less than this share of the force, there people do it: 42 of 44
synthetic people who tip something have no side that is so much lighter."""

SWAP_SMOOTHING = 5
"""Frames (standard deviation) over which hands that change sides come to what they hold."""

_HALF_TURN = torch.tensor([-1.0, -1.0, 1.0]).repeat(2)
_OTHER_HAND = [3, 4, 5, 0, 1, 2, 7, 6]
_PLACES = torch.arange(len(_OTHER_HAND)) < len(_HALF_TURN)


def move_to_lighter_side(features: Samples, clip: ObjectClip) -> Samples:
    """The same samples; who tips the object from the side where it is heavy changes sides.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts.
        clip: the object.
    """
    if clip.lever is None:
        return features
    away = half_turn(features)
    here, there = PalmHolds.of(features, clip), PalmHolds.of(away, clip)
    heavy = there.effort < LIGHTER * here.effort
    change = heavy & there.as_good_as(here) if heavy.any() else heavy
    return torch.where(torch.from_numpy(change)[:, None, None], away, features)


def add_opposite_side(features: Samples, clip: ObjectClip) -> Samples:
    """The same samples, of which the last give way to the other side of the first.

    Args:
        features: as above, the most telling first.
        clip: the object.
    """
    away = half_turn(features)
    here, there = PalmHolds.of(features, clip), PalmHolds.of(away, clip)
    possible = there.as_good_as(here)
    if clip.lever is not None:
        possible &= ~(here.effort < LIGHTER * there.effort)
    changed = np.flatnonzero(possible)[: len(features) // ONE_IN]
    return torch.cat([features[: len(features) - len(changed)], away[changed]])


def half_turn(features: Samples) -> Samples:
    """Half a turn about the object's centre."""
    away = features.clone()
    away[..., : len(_HALF_TURN)] *= _HALF_TURN
    return away


def swap_hands(features: Samples) -> Samples:
    """From the other side to the same places: what the left hand held the right one holds.

    Hands that hold nothing are as half a turn away.
    """
    held = (features[..., len(_HALF_TURN) :] > 0).any(dim=-1).numpy().astype(float)
    weight = torch.from_numpy(gaussian_filter1d(held, SWAP_SMOOTHING, axis=-1)).to(features)[
        ..., None
    ]
    changed = features[..., _OTHER_HAND]
    return torch.where(_PLACES, weight * changed + (1 - weight) * half_turn(features), changed)
