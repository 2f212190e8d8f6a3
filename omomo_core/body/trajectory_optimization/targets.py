"""Targets of the solver: of the hands and the object, of a whole clip, and of the frames that are evaluated.

The three share their names: `palms` and `R_world_wrist` say where hands go, `hold` how firmly, `obstacle`
what the body stays out of, `balance` where the weight must be over the feet.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle, Obstacle


@dataclass(frozen=True)
class InteractionTargets:
    """Where the hands of K samples hold a mesh, and the mesh as an obstacle; single precision."""

    palms: Float[Tensor, "samples frames 2 3"]
    """Left and right palm, world, metres."""
    hold: Float[Tensor, "samples frames 2"]
    """How strongly each palm must be there, in [0, 1]."""
    R_world_wrist: Float[Tensor, "samples frames 2 3 3"]
    """How a holding hand should be turned."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    obstacle: MeshObstacle
    """What the body must stay out of."""
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the object may be leant on."""


@dataclass(frozen=True)
class SolverTargets:
    """Targets of one clip or of several with the same object: hands, feet, obstacle and carried mass."""

    palms: Float[np.ndarray, "*b frames 2 3"]
    """Left and right palm, world, metres."""
    R_world_wrist: Float[np.ndarray, "*b frames 2 3 3"]
    hold: Float[np.ndarray, "*b frames 2"]
    """0 where a hand is free, 1 where it holds, smooth between."""
    ankles: Float[np.ndarray, "*b frames 2 3"]
    """Of the initial motion, world, metres."""
    soles: Float[np.ndarray, "*b frames 4 3"]
    """Left heel, right heel, left ball, right ball, world, metres."""
    planted: Bool[np.ndarray, "*b frames 4"]
    """Which of the soles stand."""
    centre: Float[np.ndarray, "*b frames 3"]
    """Centre of mass of the initial motion, which counts as balanced wherever its feet seem to be."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    obstacle: Obstacle
    """What the body must stay out of."""
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the object may be leant on."""
    carried_mass: float
    """Mass of the object while it is carried, kilograms; 0 where it stands on its own."""

    def select(self, clips: slice) -> "SolverTargets":
        """Return the targets of some of several clips."""
        shared = ("T_world_object", "obstacle", "balance", "carried_mass")
        own = (f.name for f in fields(self) if f.name not in shared)
        return replace(self, **{name: getattr(self, name)[clips] for name in own})


@dataclass(frozen=True)
class FrameTargets:
    """Targets at the frames that are evaluated, of all clips one after another; single precision."""

    palms: Float[Tensor, "times 2 3"]
    R_world_wrist: Float[Tensor, "times 2 3 3"]
    hold: Float[Tensor, "times 2"]
    ankles: Float[Tensor, "times 2 3"]
    planted: Float[Tensor, "times 2"]
    """How firmly each foot stands, in [0, 1]."""
    support: Float[Tensor, "times directions"]
    """How far the feet support in each horizontal direction, world, metres."""
    balance: Float[Tensor, " times"]
    carried_moment: Float[Tensor, "times 3"]
    """Mass times position of the object where it is carried, kilogram metres."""
    carried_mass: Float[Tensor, " times"]
    T_world_object: Float[Tensor, "times 4 4"]
    obstacle: Obstacle
