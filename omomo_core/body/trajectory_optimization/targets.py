"""What a polished motion has to satisfy."""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.body.trajectory_optimization.obstacle import Barrier


@dataclass(frozen=True)
class Targets:
    """Goals of hands and feet, what must not be run into, and what is carried: of one clip or several."""

    palms: Float[np.ndarray, "*b frames 2 3"]
    """World, metres; left, right."""
    R_world_wrist: Float[np.ndarray, "*b frames 2 3 3"]
    pull: Float[np.ndarray, "*b frames 2"]
    """0 where a hand is free, 1 where it holds, smooth between."""
    ankles: Float[np.ndarray, "*b frames 2 3"]
    """Of the base motion, world, metres."""
    soles: Float[np.ndarray, "*b frames 4 3"]
    """Left heel, right heel, left ball, right ball, world, metres."""
    planted: Bool[np.ndarray, "*b frames 4"]
    """Which of the soles stand."""
    centre: Float[np.ndarray, "*b frames 3"]
    """Centre of mass of the base motion, which was in balance whatever its feet seem to say."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    barrier: Barrier
    """The object, which no flesh may be inside of."""
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the object may be leant on."""
    load: float
    """Mass of the object while it is carried, kilograms (0: it stands on its own)."""

    def of(self, clips: slice) -> "Targets":
        """Some of several clips."""
        shared = ("T_world_object", "barrier", "balance", "load")
        own = (f.name for f in fields(self) if f.name not in shared)
        return replace(self, **{name: getattr(self, name)[clips] for name in own})
