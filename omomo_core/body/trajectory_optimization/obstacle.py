"""Obstacles for the solver: an object as boxes, or as the signed distance to its surface.

Each is in the object's own frame, metres; its `middle` stands for the centre of mass.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.geometry.distance_field import DistanceField

_Depth = tuple[Float[Tensor, "times flesh"], Float[Tensor, "times flesh 3"]]


@dataclass(frozen=True)
class BoxObstacle:
    """An object made of boxes along its axes."""

    low: Float[Tensor, "parts 3"]
    high: Float[Tensor, "parts 3"]

    @property
    def middle(self) -> Float[Tensor, "3"]:
        """Middle of the box around all parts."""
        return (self.low.amin(dim=0) + self.high.amax(dim=0)) / 2

    def depth(
        self, points: Float[Tensor, "times flesh 3"], radii: Float[Tensor, " flesh"]
    ) -> _Depth:
        """Return each sphere's depth in the box it is deepest in (negative: apart), and the direction out."""
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        local = points[:, :, None] - middle
        beyond = local.abs() - half
        outside = beyond.clamp(min=0.0).norm(dim=-1)
        depth, part = (radii[:, None] - outside - beyond.amax(dim=-1).clamp(max=0.0)).max(dim=-1)
        index = part[..., None, None].expand(*part.shape, 1, 3)
        local, beyond = local.gather(2, index)[:, :, 0], beyond.gather(2, index)[:, :, 0]
        nearest = torch.nn.functional.one_hot(beyond.argmax(dim=-1), 3)
        inside = (beyond.amax(dim=-1, keepdim=True) <= 0).to(beyond)
        way = inside * nearest + (1 - inside) * beyond.clamp(min=0.0)
        return depth, torch.nn.functional.normalize(way * local.sign(), dim=-1)


@dataclass(frozen=True)
class MeshObstacle:
    """A mesh, as the signed distance to its surface."""

    field: DistanceField
    middle: Float[Tensor, "3"]

    def depth(
        self, points: Float[Tensor, "times flesh 3"], radii: Float[Tensor, " flesh"]
    ) -> _Depth:
        """Return each sphere's depth inside (negative: apart), and the direction out by the gradient.

        The direction is zero for spheres that never touch.
        """
        depth = radii - self.field.at(points)
        hit, away = (depth > 0).any(dim=0), torch.zeros_like(points)
        away[:, hit] = self.field.away(points[:, hit])
        return depth, away


Obstacle = BoxObstacle | MeshObstacle
