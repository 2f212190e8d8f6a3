"""Between the body the networks were trained on and the one asked for, when their bones differ."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.model import BodyModel


@dataclass(frozen=True)
class Fit:
    """The hips carry over: their way on the floor by stature, their height by length of leg.

    A body that only has another stature gets the same scene scaled; one whose pelvis joint sits
    elsewhere above its hips, or whose legs are long for its stature, still stands on the floor.
    """

    trained: BodyModel
    body: BodyModel

    @property
    def scale(self) -> float:
        """Lengths of the trained body over those of the other."""
        return self.trained.height / self.body.height

    def to_body(
        self, root: Float[Tensor, "*b 3"], pelvis: Float[Tensor, "*b 3 3"]
    ) -> Float[Tensor, "*b 3"]:
        """The body's pelvis joint from the trained body's and its rotation, world, metres."""
        size = self._size().to(root)
        return (root + pelvis @ _hips(self.trained).to(root)) / size - pelvis @ _hips(self.body).to(
            root
        )

    def to_trained(
        self, root: Float[Tensor, "*b 3"], pelvis: Float[Tensor, "*b 3 3"]
    ) -> Float[Tensor, "*b 3"]:
        """Inverse of `to_body`."""
        size = self._size().to(root)
        return (root + pelvis @ _hips(self.body).to(root)) * size - pelvis @ _hips(self.trained).to(
            root
        )

    def _size(self) -> Float[Tensor, "3"]:
        heights = [float(b.rest_joints[[1, 2], 1].mean()) for b in (self.trained, self.body)]
        return torch.tensor([self.scale, self.scale, heights[0] / heights[1]])


def _hips(body: BodyModel) -> Float[Tensor, "3"]:
    """Middle of the hips from the pelvis joint, at rest."""
    return body.rest_joints[[1, 2]].mean(dim=0) - body.rest_joints[0]
