"""Fingers that close on what a hand holds: a synergy grasp.

Each finger has one degree of freedom, from an open hand to a fist, its three joints in a fixed
proportion; the thumb may also be laid beside the palm or turned against the fingers. Of all these
postures a finger takes the one that touches most of the surface and enters none of it, so it lies on a
wall and wraps around a pole. What meets no surface stays half open.
"""

from dataclasses import dataclass
from typing import cast

import roma
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.hand import HandModel, Posture, finger_rotations, hand_model, sphere_centres
from omomo_core.body.model import BodyModel
from omomo_core.geometry.distance_field import DistanceField

ALLOWED = 0.002
"""Metres that flesh gives way where it touches."""
NEAR = 0.006
"""A finger this far from the surface touches it about a third as much."""
IDLE = 0.3
"""Closing of a finger that meets nothing."""
"""Frames: how smoothly fingers move."""
_FINE, _STEP = 97, 8
"""Closings in all, and from one to the next of those that are tried first."""
_OPPOSED = (0.15, 0.45, 0.7, 0.95)
"""How far round the thumb is tried, 0 beside the palm to 1 against the fingers."""
_CHUNK = 1024
"""Hands solved at once."""
