"""Retargeting between the body that the networks were trained on and the one that is asked for."""

from dataclasses import dataclass
from functools import cached_property

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.generation.config import RETARGETING
from omomo_core.skeleton import joint

_LEGS: dict[LimbName, tuple[int, int]] = {
    "left_leg": (joint("left_knee"), joint("left_ankle")),
    "right_leg": (joint("right_knee"), joint("right_ankle")),
}
_LEG_JOINTS = [joint(f"{s}_{part}") for s in ("left", "right") for part in ("hip", "knee", "ankle")]


@dataclass(frozen=True)
class Retargeting:
    """Maps poses between two bodies: hips and feet keep their places, and knees point to where they were.

    Horizontal distances scale with the stature, heights with the height of the hips. So a body that differs
    in stature only moves as the same scene scaled; one whose pelvis joint lies elsewhere above its hips, or
    whose legs are long for its stature, still stands on the floor; and one whose hip joints lie closer
    together stands as wide. A body in shoes is higher by their soles.
    """

    trained: BodyModel
    body: BodyModel

    @property
    def scale(self) -> float:
        """Stature of the trained body over that of the other."""
        return self.trained.height / self.body.height

    def to_body(
        self, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
    ) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
        """Return the body's pelvis joint (world, metres) and global rotations from the trained body's."""
        return self._carried(self.trained, self.body, root, rotations, 1 / self._size().to(root))

    def to_trained(
        self, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
    ) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
        """Inverse of `to_body`."""
        return self._carried(self.body, self.trained, root, rotations, self._size().to(root))

    def _carried(
        self,
        old: BodyModel,
        new: BodyModel,
        root: Float[Tensor, "*b 3"],
        rotations: Float[Tensor, "*b 22 3 3"],
        size: Float[Tensor, "3"],
    ) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
        pelvis = rotations[..., 0, :, :]
        lowered, raised = (torch.tensor([0.0, 0.0, b.shoe_sole]).to(root) for b in (old, new))
        hips = (root + pelvis @ old.hips.to(root) - lowered) * size + raised
        moved = hips - pelvis @ new.hips.to(root)
        if self._legs_alike:
            return moved, rotations
        places = (forward_kinematics(old, root, rotations) - lowered) * size + raised
        for leg, (knee, ankle) in _LEGS.items():
            pole = places[..., knee, :] - places[..., ankle, :]
            rotations, _ = reach(new, moved, rotations, leg, places[..., ankle, :], pole)
        return moved, rotations

    @cached_property
    def _legs_alike(self) -> bool:
        apart = (self.body.rest_joints * self.scale - self.trained.rest_joints)[_LEG_JOINTS]
        return bool((apart - apart[0]).abs().max() < RETARGETING.equal_legs)

    def _size(self) -> Float[Tensor, "3"]:
        heights = [
            float(b.rest_joints[[1, 2], 1].mean()) - b.shoe_sole for b in (self.trained, self.body)
        ]
        return torch.tensor([self.scale, self.scale, heights[0] / heights[1]])
