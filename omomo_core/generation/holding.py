"""Where guesses of the palms hold the object, and whether anybody would hold it so."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.generation.scene import Scene
from omomo_core.geometry.transforms import to_local
from omomo_core.hand_stage import capture as hand_stage

Samples = Float[Tensor, "samples frames 8"]
GRASP = 0.15
"""Metres between the surface and palms that hold it; contacts bring them onto it."""
TURNED, OFTEN = 60.0, 0.9
"""Degrees by which the line between two palms that hold may leave its mean in the object, and the share of
frames in which it may not. Guesses of several windows may hold from one side at first, then from another."""


@dataclass(frozen=True)
class Holding:
    """Where samples hold the object, and how."""

    palms: Float[np.ndarray, "samples frames 2 3"]
    """In the object's frame, trained size."""
    held: Bool[np.ndarray, "samples frames 2"]
    scene: Scene

    @staticmethod
    def of(features: Samples, scene: Scene) -> "Holding":
        """Of samples as the network says them: palms from the object's centre, world axes, contacts."""
        centre = torch.from_numpy(scene.trained.centre).float().expand(len(features), -1, 3)
        palms, contact = hand_stage.unpack(features, centre)
        T = scene.trained.motion.T_world_object
        local = np.stack([to_local(T, p) for p in palms.double().numpy()])
        return Holding(local, (contact > 0.5).numpy(), scene)

    def as_good_as(self, other: "Holding") -> Bool[np.ndarray, " samples"]:
        """Whether it is about as near to the surface."""
        return self.from_surface - other.from_surface < GRASP

    @property
    def from_surface(self) -> Float[np.ndarray, " samples"]:
        """Mean metres between palms that hold and the object's surface; 0 where none holds."""
        far = np.asarray(self.scene.trained.surface.tree.query(self.palms)[0]) / self.scene.scale
        count = np.maximum(self.held.sum(axis=(1, 2)), 1)
        return np.where(self.held, far, 0).sum(axis=(1, 2)) / count

    @property
    def likely(self) -> Bool[np.ndarray, " samples"]:
        """Whether the palms hold nothing but the object, and stay on their sides of it while both do."""
        return (self.from_surface < GRASP) & (self._turn < TURNED)

    @property
    def _turn(self) -> Float[np.ndarray, " samples"]:
        """Degrees between the line from palm to palm and its mean in the object's frame, in most frames."""
        line = self.palms[:, :, 1] - self.palms[:, :, 0]
        line /= np.linalg.norm(line, axis=-1, keepdims=True).clip(1e-6)
        mean = np.where(self.held.all(axis=-1)[..., None], line, 0).sum(axis=1)
        mean /= np.linalg.norm(mean, axis=-1, keepdims=True).clip(1e-6)
        along = np.einsum("sfx,sx->sf", line, mean)
        both = self.held.all(axis=-1)
        most = [
            np.quantile(a[b], 1 - OFTEN) if b.any() else 1.0
            for a, b in zip(along, both, strict=True)
        ]
        return np.degrees(np.arccos(np.clip(most, -1, 1)))

    @property
    def effort(self) -> Float[np.ndarray, " samples"]:
        """What it takes to hold up an object that is tipped."""
        lever = self.scene.lever
        assert lever is not None
        return lever.effort(self.palms[:, lever.frames], self.held[:, lever.frames])
