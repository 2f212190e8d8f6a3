"""Samples in which the person stands on the other side of the object.

From how a thing moves nobody can always tell which side it was moved from, and the network is surer than
it is right. A guess given half a turn about the upright line through the object's centre keeps the left
hand left and the right hand right, and is as good wherever the object has a surface there too.
"""

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.generation.scene import Scene
from omomo_core.geometry.transforms import to_local
from omomo_core.hand_stage import capture as hand_stage

ONE_IN = 5
"""One of so many samples changes sides."""
GRASP = 0.15
"""Metres by which palms that hold may be farther from the surface there; contacts bring them onto it."""

_HALF_TURN = torch.tensor([-1.0, -1.0, 1.0]).repeat(2)


def with_opposite(
    features: Float[Tensor, "samples frames 8"], scene: Scene
) -> Float[Tensor, "samples frames 8"]:
    """The same samples, of which the last give way to the other side of the first.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts; the most telling
            first.
        scene: the object.
    """
    away = features.clone()
    away[..., : len(_HALF_TURN)] *= _HALF_TURN
    farther = _from_surface(away, scene) - _from_surface(features, scene)
    there = np.flatnonzero(farther < GRASP)[: len(features) // ONE_IN]
    return torch.cat([features[: len(features) - len(there)], away[there]])


def _from_surface(
    features: Float[Tensor, "samples frames 8"], scene: Scene
) -> Float[np.ndarray, " samples"]:
    """Mean metres between palms that hold and the object's surface; 0 where none holds."""
    centre = torch.from_numpy(scene.trained.centre).float().expand(len(features), -1, 3)
    palms, contact = hand_stage.unpack(features, centre)
    held = (contact > 0.5).numpy()
    take = scene.trained
    local = [to_local(take.motion.T_world_object, p) for p in palms.double().numpy()]
    far = np.asarray(take.surface.tree.query(np.stack(local))[0]) / scene.scale
    return np.where(held, far, 0).sum(axis=(1, 2)) / np.maximum(held.sum(axis=(1, 2)), 1)
