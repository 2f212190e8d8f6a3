"""Choice of a side of the object: the cheapest path through a few choices over time (Viterbi).

Gradients push flesh across a thin board out of both its faces at once, and it stays. So sides are chosen
first: every choice is tried in every evaluated frame, and the path is found that is least inside the object,
nearest to the present body, and steady.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.trajectory_optimization.anatomy import Anatomy
from omomo_core.body.trajectory_optimization.residuals import anatomy_points
from omomo_core.generation.collision.config import SIDES
from omomo_core.geometry.cheapest_path import cheapest_path
from omomo_core.geometry.distance_field import DistanceField

Spheres = Float[Tensor, "samples seen balls 3"]
Cost = Float[Tensor, "samples seen choices"]
Places = Callable[[Tensor, Tensor, Tensor], Float[Tensor, "some choices 3"]]
"""Positions of some spheres by each choice, given their samples, frames and numbers; world, metres."""


@dataclass(frozen=True)
class CollisionAvoidance:
    """An object that a body has to avoid, at the evaluated frames."""

    anatomy: Anatomy
    field: DistanceField
    T_world_object: Float[Tensor, "seen 4 4"]
    seen: Int[np.ndarray, " seen"]
    free: Float[Tensor, " frames"]
    """How far each frame may be changed, from 0 to 1."""
    stride: int
    """Frames from one evaluated frame to the next."""

    @staticmethod
    def of(
        anatomy: Anatomy,
        field: DistanceField,
        T_world_object: Float[np.ndarray, "frames 4 4"],
        free: Float[Tensor, " frames"],
        stride: int = SIDES.stride,
    ) -> "CollisionAvoidance":
        """Return the object at every `stride`-th frame and the last one."""
        frames = len(T_world_object)
        seen = np.unique(np.append(np.arange(0, frames, stride), frames - 1))
        T = torch.from_numpy(T_world_object[seen]).float()
        return CollisionAvoidance(anatomy, field, T, seen, free, stride)

    def spheres(
        self,
        root: Float[Tensor, "samples seen 3"],
        rotations: Float[Tensor, "samples seen 22 3 3"],
    ) -> Spheres:
        """Return the centres of all collision spheres, world, metres."""
        points, _ = anatomy_points(self.anatomy, root.flatten(0, 1), rotations.flatten(0, 1))
        return points[:, 5:].unflatten(0, root.shape[:2])

    def collision_cost(
        self,
        now: Spheres,
        radii: Float[Tensor, " spheres"],
        far: float,
        places: Places,
        choices: int,
    ) -> Cost | None:
        """Return the penetration cost of each choice; None where nothing is inside the object now.

        Args:
            now: present spheres, world, metres.
            radii: their radii, metres.
            far: how far a choice moves any of them at most, metres.
            places: their positions by each choice.
            choices: how many choices there are.
        """
        clear = self._distance(now, self.T_world_object) - radii
        if not ((clear < 0) & (self.free[self.seen] > 0.5)[:, None]).any():
            return None
        # A sphere that is farther away than it can be moved is clear by any choice.
        sample, frame, ball = (clear < far).nonzero(as_tuple=True)
        at = places(sample, frame, ball)
        depth = radii[ball, None] - self._distance(at, self.T_world_object[frame])
        cost = now.new_zeros(*now.shape[:2], choices)
        return cost.index_put_((sample, frame), _squared_depth(depth), accumulate=True)

    def penetration_cost(
        self, at: Spheres, radii: Float[Tensor, " spheres"]
    ) -> Float[Tensor, "samples seen balls"]:
        """Return the cost of each sphere's penetration.

        Args:
            at: spheres, world, metres.
            radii: their radii, metres.
        """
        return _squared_depth(radii - self._distance(at, self.T_world_object))

    def _distance(
        self, at: Float[Tensor, "*b some 3"], T: Float[Tensor, "*c 4 4"]
    ) -> Float[Tensor, "*b some"]:
        """Return the signed distance of points to the object in the pose of their frame, metres."""
        return self.field.at((at - T[..., None, :3, 3]) @ T[..., :3, :3])

    def cheapest_values(
        self,
        cost: Cost,
        values: Float[Tensor, "choices n"],
        between: Float[Tensor, "*steps choices choices"],
    ) -> Float[Tensor, "samples seen n"]:
        """Return the values along the cheapest path; the first choice changes nothing.

        Args:
            cost: of each choice.
            values: of each choice.
            between: cost of a change, one for all steps or one for each (samples, seen - 1).
        """
        kept = self.free[self.seen] < 0.5
        cost = cost.clone()
        cost[:, kept, 1:] += SIDES.fixed
        return values[cheapest_path(cost, between)]

    def smoothed(
        self, chosen: Float[Tensor, "samples seen n"]
    ) -> Float[Tensor, "samples frames n"]:
        """Return the chosen values in every frame, each blended smoothly into the next."""
        return self._between.to(chosen) @ chosen * self.free[:, None]

    @cached_property
    def _between(self) -> Float[Tensor, "frames seen"]:
        frames = np.arange(len(self.free))
        shares = np.stack([np.interp(frames, self.seen, one) for one in np.eye(len(self.seen))], 1)
        return torch.from_numpy(gaussian_filter1d(shares, self.stride, axis=0, mode="nearest"))


def _squared_depth(depth: Tensor) -> Tensor:
    return SIDES.penetration * depth.clamp(min=0).square()


def level_shifts(step: float, farthest: float) -> Float[Tensor, "choices 3"]:
    """Return horizontal shifts on a grid within a circle, nearest first, metres."""
    count = round(farthest / step)
    axis = step * torch.arange(-count, count + 1)
    level = torch.cartesian_prod(axis, axis, torch.zeros(1))
    level = level[level.norm(dim=-1) < 1.001 * farthest]
    return level[level.norm(dim=-1).argsort(stable=True)]


def squared_distances(values: Float[Tensor, "choices n"]) -> Float[Tensor, "choices choices"]:
    """Return the squared distance from each choice to each."""
    return (values[:, None] - values).square().sum(dim=-1)
