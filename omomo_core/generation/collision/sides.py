"""On which side of an object somebody is: the cheapest course of a few choices over time.

Flesh that is across a thin board is pushed out of both its faces at once, and stays. So sides are
chosen first: every choice is tried in every frame, and the course through them is found that is least
inside the object, least far from where the body is, and steady.
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
from omomo_core.geometry.distance_field import DistanceField

STRIDE, FINE = 5, 2
"""Frames between choices, and (standard deviation) over which a choice passes into the next; of the
last ones, for what is thin passes quickly by."""
INSIDE = 400.0
"""Cost of depth, 1 / m^2: 5 cm of one ball is 1."""
_FIXED = 1e6
"""Cost of changing what is decided."""

Spheres = Float[Tensor, "samples seen balls 3"]
Cost = Float[Tensor, "samples seen choices"]
Places = Callable[[Tensor, Tensor, Tensor], Float[Tensor, "some choices 3"]]
"""Where each choice puts some balls, given their samples, frames and numbers; world, metres."""


@dataclass(frozen=True)
class CollisionAvoidance:
    """An object around which somebody has to be, at the frames that are looked at."""

    anatomy: Anatomy
    field: DistanceField
    T_world_object: Float[Tensor, "seen 4 4"]
    seen: Int[np.ndarray, " seen"]
    free: Float[Tensor, " frames"]
    """How far each frame may be changed, from 0 to 1."""
    stride: int
    """Frames between those."""

    @staticmethod
    def of(
        anatomy: Anatomy,
        field: DistanceField,
        T_world_object: Float[np.ndarray, "frames 4 4"],
        free: Float[Tensor, " frames"],
        stride: int = STRIDE,
    ) -> "CollisionAvoidance":
        """Look at every few frames."""
        frames = len(T_world_object)
        seen = np.unique(np.append(np.arange(0, frames, stride), frames - 1))
        T = torch.from_numpy(T_world_object[seen]).float()
        return CollisionAvoidance(anatomy, field, T, seen, free, stride)

    def spheres(
        self,
        root: Float[Tensor, "samples seen 3"],
        rotations: Float[Tensor, "samples seen 22 3 3"],
    ) -> Spheres:
        """All the flesh, world, metres."""
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
        """What each choice costs for flesh that is inside the object; None where none is by now.

        Args:
            now: balls as they are, world, metres.
            radii: theirs.
            far: how far a choice moves any of them at most, metres.
            places: where each choice puts them.
            choices: how many there are.
        """
        clear = self._distance(now, self.T_world_object) - radii
        if not ((clear < 0) & (self.free[self.seen] > 0.5)[:, None]).any():
            return None
        # What is farther away than it can be moved is clear by any choice.
        sample, frame, ball = (clear < far).nonzero(as_tuple=True)
        at = places(sample, frame, ball)
        depth = radii[ball, None] - self._distance(at, self.T_world_object[frame])
        cost = now.new_zeros(*now.shape[:2], choices)
        return cost.index_put_((sample, frame), _squared_depth(depth), accumulate=True)

    def penetration_cost(
        self, at: Spheres, radii: Float[Tensor, " spheres"]
    ) -> Float[Tensor, "samples seen balls"]:
        """What each ball costs for being inside the object.

        Args:
            at: balls, world, metres.
            radii: theirs.
        """
        return _squared_depth(radii - self._distance(at, self.T_world_object))

    def _distance(
        self, at: Float[Tensor, "*b some 3"], T: Float[Tensor, "*c 4 4"]
    ) -> Float[Tensor, "*b some"]:
        """From places in the world to the object, in the pose that belongs to them."""
        return self.field.at((at - T[..., None, :3, 3]) @ T[..., :3, :3])

    def cheapest_values(
        self,
        cost: Cost,
        values: Float[Tensor, "choices n"],
        between: Float[Tensor, "*steps choices choices"],
    ) -> Float[Tensor, "samples seen n"]:
        """Values along the cheapest course; the first choice is to leave everything as it is.

        Args:
            cost: of each choice.
            values: what is chosen between.
            between: what a change costs, always or (samples, seen - 1) for each.
        """
        kept = self.free[self.seen] < 0.5
        cost = cost.clone()
        cost[:, kept, 1:] += _FIXED
        return values[viterbi(cost, between)]

    def smoothed(
        self, chosen: Float[Tensor, "samples seen n"]
    ) -> Float[Tensor, "samples frames n"]:
        """Choices in every frame, one passing smoothly into the next."""
        return self._between.to(chosen) @ chosen * self.free[:, None]

    @cached_property
    def _between(self) -> Float[Tensor, "frames seen"]:
        frames = np.arange(len(self.free))
        shares = np.stack([np.interp(frames, self.seen, one) for one in np.eye(len(self.seen))], 1)
        return torch.from_numpy(gaussian_filter1d(shares, self.stride, axis=0, mode="nearest"))


def _squared_depth(depth: Tensor) -> Tensor:
    return INSIDE * depth.clamp(min=0).square()


def viterbi(
    cost: Cost, between: Float[Tensor, "*steps choices choices"]
) -> Int[Tensor, "samples seen"]:
    """Which choice to make when (Viterbi): the least sum of what choices and changes cost."""
    steps = cost.shape[1] - 1
    change = between.expand(*cost.shape[:1], steps, *between.shape[-2:])
    best, came = cost[:, 0], list[Tensor]()
    for step in range(steps):
        least, before = (best[:, :, None] + change[:, step]).min(dim=1)
        best = least + cost[:, step + 1]
        came.append(before)
    path = [best.argmin(dim=1)]
    for before in reversed(came):
        path.append(before.gather(1, path[-1][:, None])[:, 0])
    return torch.stack(path[::-1], dim=1)


def level_shifts(step: float, farthest: float) -> Float[Tensor, "choices 3"]:
    """Level shifts on a grid, none first, metres."""
    count = round(farthest / step)
    axis = step * torch.arange(-count, count + 1)
    level = torch.cartesian_prod(axis, axis, torch.zeros(1))
    level = level[level.norm(dim=-1) < 1.001 * farthest]
    return level[level.norm(dim=-1).argsort(stable=True)]


def squared_distances(values: Float[Tensor, "choices n"]) -> Float[Tensor, "choices choices"]:
    """Squared distance from each choice to each."""
    return (values[:, None] - values).square().sum(dim=-1)
