"""Plausibility of palm hypotheses: whether they hold the object where and as a person could."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import uniform_filter1d
from torch import Tensor

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.config import PLAUSIBILITY
from omomo_core.geometry.transforms import to_local
from omomo_core.stages.hands import capture as hand_stage

Samples = Float[Tensor, "samples frames 8"]
"""Features of stage 1: left and right palm from the object's centre, contacts of both from -1 to 1."""
Hypotheses = Float[Tensor, "hypotheses frames 8"]
"""The same features of all hypotheses from which samples are selected."""


@dataclass(frozen=True)
class PalmHolds:
    """Where and when the palms of samples hold the object."""

    palms: Float[np.ndarray, "samples frames 2 3"]
    """In the object's frame, trained size."""
    held: Bool[np.ndarray, "samples frames 2"]
    clip: ObjectClip

    @staticmethod
    def of(features: Samples, clip: ObjectClip) -> "PalmHolds":
        """Return the holds of samples, given the features of stage 1 in world axes."""
        centre = torch.from_numpy(clip.trained.centre).float().expand(len(features), -1, 3)
        palms, contact = hand_stage.unpack(features, centre)
        T = clip.trained.motion.T_world_object
        local = np.stack([to_local(T, p) for p in palms.double().numpy()])
        return PalmHolds(local, (contact > 0.5).numpy(), clip)

    def as_good_as(self, other: "PalmHolds") -> Bool[np.ndarray, " samples"]:
        """Whether each sample's palms are about as near to the surface as those of `other`."""
        return self.from_surface - other.from_surface < PLAUSIBILITY.grasp_distance

    @property
    def from_surface(self) -> Float[np.ndarray, " samples"]:
        """Mean distance of holding palms from the object's surface, metres; 0 where none holds."""
        far = np.asarray(self.clip.trained.surface.tree.query(self.palms)[0]) / self.clip.scale
        count = np.maximum(self.held.sum(axis=(1, 2)), 1)
        return np.where(self.held, far, 0).sum(axis=(1, 2)) / count

    @property
    def plausible(self) -> Bool[np.ndarray, " samples"]:
        """Whether holding palms are at the surface, and stay on their sides of the object while both hold."""
        return (self.from_surface < PLAUSIBILITY.grasp_distance) & (
            self._turn < PLAUSIBILITY.largest_turn
        )

    @property
    def _turn(self) -> Float[np.ndarray, " samples"]:
        """Largest lasting angle between the line from palm to palm and its mean in the object, degrees."""
        line = self.palms[:, :, 1] - self.palms[:, :, 0]
        line /= np.linalg.norm(line, axis=-1, keepdims=True).clip(1e-6)
        both: Bool[np.ndarray, "samples frames"] = np.asarray(self.held.all(axis=-1))
        mean = np.where(both[..., None], line, 0).sum(axis=1)
        mean /= np.linalg.norm(mean, axis=-1, keepdims=True).clip(1e-6)
        along = np.where(both, np.einsum("sfx,sx->sf", line, mean), 1.0)
        off = np.degrees(np.arccos(np.clip(along, -1, 1)))
        return np.asarray(uniform_filter1d(off, PLAUSIBILITY.lasting, axis=1)).max(axis=1)

    @property
    def effort(self) -> Float[np.ndarray, " samples"]:
        """Force that holds up a tipped object, as a share of its weight (`TippingLever.effort`)."""
        lever = self.clip.lever
        assert lever is not None
        return lever.effort(self.palms[:, lever.frames], self.held[:, lever.frames])
