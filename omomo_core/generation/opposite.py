"""Samples in which the person stands on the other side of the object.

A guess given half a turn about the upright line through the object's centre keeps the left hand left and
the right hand right, and is as good wherever the object has a surface there too. Where the object stands
on an edge, its weight tells which side is the right one. Where it does not, nobody can always tell from
how a thing moves which side it was moved from, and the network is surer than it is right.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float
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

_HALF_TURN = torch.tensor([-1.0, -1.0, 1.0]).repeat(2)
Samples = Float[Tensor, "samples frames 8"]


def on_lighter_side(features: Samples, scene: Scene) -> Samples:
    """The same samples; who tips the object from the side where it is heavy changes sides.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts.
        scene: the object.
    """
    if scene.lever is None:
        return features
    away = _across(features)
    heavy = _efforts(away, scene) < LIGHTER * _efforts(features, scene)
    change = torch.from_numpy(heavy & _graspable(away, features, scene))
    return torch.where(change[:, None, None], away, features)


def with_opposite(features: Samples, scene: Scene) -> Samples:
    """The same samples, of which the last give way to the other side of the first.

    Args:
        features: as above, the most telling first.
        scene: the object.
    """
    away = _across(features)
    there = _graspable(away, features, scene)
    if scene.lever is not None:
        there &= ~(_efforts(features, scene) < LIGHTER * _efforts(away, scene))
    changed = np.flatnonzero(there)[: len(features) // ONE_IN]
    return torch.cat([features[: len(features) - len(changed)], away[changed]])


def _across(features: Samples) -> Samples:
    away = features.clone()
    away[..., : len(_HALF_TURN)] *= _HALF_TURN
    return away


def _graspable(away: Samples, features: Samples, scene: Scene) -> Bool[np.ndarray, " samples"]:
    return _from_surface(away, scene) - _from_surface(features, scene) < GRASP


def _from_surface(features: Samples, scene: Scene) -> Float[np.ndarray, " samples"]:
    """Mean metres between palms that hold and the object's surface; 0 where none holds."""
    palms, held = _palms(features, scene)
    far = np.asarray(scene.trained.surface.tree.query(palms)[0]) / scene.scale
    return np.where(held, far, 0).sum(axis=(1, 2)) / np.maximum(held.sum(axis=(1, 2)), 1)


def _efforts(features: Samples, scene: Scene) -> Float[np.ndarray, " samples"]:
    assert scene.lever is not None
    palms, held = _palms(features, scene)
    return scene.lever.effort(palms[:, scene.lever.frames], held[:, scene.lever.frames])


def _palms(
    features: Samples, scene: Scene
) -> tuple[Float[np.ndarray, "samples frames 2 3"], Bool[np.ndarray, "samples frames 2"]]:
    """Palms in the object's frame, and whether they hold."""
    centre = torch.from_numpy(scene.trained.centre).float().expand(len(features), -1, 3)
    palms, contact = hand_stage.unpack(features, centre)
    T = scene.trained.motion.T_world_object
    return np.stack([to_local(T, p) for p in palms.double().numpy()]), (contact > 0.5).numpy()
