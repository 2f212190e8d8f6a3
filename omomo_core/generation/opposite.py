"""Samples in which the person stands on the other side.

A guess given half a turn about the upright line through the object's centre keeps the left hand left and
the right hand right, and is as good wherever the object has a surface there too. Where the object stands
on an edge, its weight tells which side is the right one. Where it does not, nobody can always tell from
how a thing moves which side it was moved from, and the network is surer than it is right. The other side
of a chair's back is another matter: there the hands are where they were, the left where the right was.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.generation.scene import Scene
from omomo_core.geometry.transforms import to_local
from omomo_core.hand_stage import capture as hand_stage

ONE_IN = 5
"""One of so many samples changes sides."""
GRASP = 0.15
"""Metres by which palms that hold may be farther from the surface there; contacts bring them onto it."""
LIGHTER = 0.9
"""Where holding up what is tipped takes less than this share of the force, there people do it: 42 of 44
synthetic people who tip something have no side that is so much lighter."""

CHANGE = 5
"""Frames (standard deviation) over which hands that change sides come to what they hold."""

_HALF_TURN = torch.tensor([-1.0, -1.0, 1.0]).repeat(2)
_OTHER_HAND = [3, 4, 5, 0, 1, 2, 7, 6]
_PLACES = torch.arange(len(_OTHER_HAND)) < len(_HALF_TURN)
Samples = Float[Tensor, "samples frames 8"]


def on_lighter_side(features: Samples, scene: Scene) -> Samples:
    """The same samples; who tips the object from the side where it is heavy changes sides.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts.
        scene: the object.
    """
    if scene.lever is None:
        return features
    away = across(features)
    here, there = _Holding.of(features, scene), _Holding.of(away, scene)
    heavy = there.effort < LIGHTER * here.effort
    change = heavy & there.as_good_as(here) if heavy.any() else heavy
    return torch.where(torch.from_numpy(change)[:, None, None], away, features)


def with_opposite(features: Samples, scene: Scene) -> Samples:
    """The same samples, of which the last give way to the other side of the first.

    Args:
        features: as above, the most telling first.
        scene: the object.
    """
    away = across(features)
    here, there = _Holding.of(features, scene), _Holding.of(away, scene)
    possible = there.as_good_as(here)
    if scene.lever is not None:
        possible &= ~(here.effort < LIGHTER * there.effort)
    changed = np.flatnonzero(possible)[: len(features) // ONE_IN]
    return torch.cat([features[: len(features) - len(changed)], away[changed]])


def across(features: Samples) -> Samples:
    """Half a turn about the object's centre."""
    away = features.clone()
    away[..., : len(_HALF_TURN)] *= _HALF_TURN
    return away


def beyond(features: Samples) -> Samples:
    """From the other side to the same places: what the left hand held the right one holds.

    Hands that hold nothing are as half a turn away.
    """
    held = (features[..., len(_HALF_TURN) :] > 0).any(dim=-1).numpy().astype(float)
    weight = torch.from_numpy(gaussian_filter1d(held, CHANGE, axis=-1)).to(features)[..., None]
    changed = features[..., _OTHER_HAND]
    return torch.where(_PLACES, weight * changed + (1 - weight) * across(features), changed)


def at_surface(features: Samples, scene: Scene) -> Bool[np.ndarray, " samples"]:
    """Which samples hold nothing but the object: contacts bring their palms onto it."""
    return _Holding.of(features, scene).from_surface < GRASP


@dataclass(frozen=True)
class _Holding:
    """Where samples hold the object, and how."""

    palms: Float[np.ndarray, "samples frames 2 3"]
    """In the object's frame, trained size."""
    held: Bool[np.ndarray, "samples frames 2"]
    scene: Scene

    @staticmethod
    def of(features: Samples, scene: Scene) -> "_Holding":
        centre = torch.from_numpy(scene.trained.centre).float().expand(len(features), -1, 3)
        palms, contact = hand_stage.unpack(features, centre)
        T = scene.trained.motion.T_world_object
        local = np.stack([to_local(T, p) for p in palms.double().numpy()])
        return _Holding(local, (contact > 0.5).numpy(), scene)

    def as_good_as(self, other: "_Holding") -> Bool[np.ndarray, " samples"]:
        """Whether it is about as near to the surface."""
        return self.from_surface - other.from_surface < GRASP

    @property
    def from_surface(self) -> Float[np.ndarray, " samples"]:
        """Mean metres between palms that hold and the object's surface; 0 where none holds."""
        far = np.asarray(self.scene.trained.surface.tree.query(self.palms)[0]) / self.scene.scale
        count = np.maximum(self.held.sum(axis=(1, 2)), 1)
        return np.where(self.held, far, 0).sum(axis=(1, 2)) / count

    @property
    def effort(self) -> Float[np.ndarray, " samples"]:
        """What it takes to hold up an object that is tipped."""
        lever = self.scene.lever
        assert lever is not None
        return lever.effort(self.palms[:, lever.frames], self.held[:, lever.frames])
