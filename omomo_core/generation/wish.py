"""What bodies are solved for."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.trajectory_optimization.obstacle import Scanned


@dataclass(frozen=True)
class Wish:
    """What the bodies are solved for."""

    palms: Float[Tensor, "samples frames 2 3"]
    """World, metres."""
    hold: Float[Tensor, "samples frames 2"]
    """How strongly each palm must be there, in [0, 1]."""
    R_world_wrist: Float[Tensor, "samples frames 2 3 3"]
    """How a holding hand should be turned."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    barrier: Scanned
    """What no flesh should be in."""
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the object may be leant on."""
