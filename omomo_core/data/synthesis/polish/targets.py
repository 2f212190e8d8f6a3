"""What a polished motion has to satisfy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.body.model import BodyModel
from omomo_core.data.grounding import foot_contacts, sole_points
from omomo_core.data.retarget import joints_of
from omomo_core.data.synthesis.hands import Hands
from omomo_core.data.synthesis.polish.anatomy import centre_of_mass
from omomo_core.data.synthesis.shapes import Part
from omomo_core.skeleton import joint

_ANKLES = (joint("left_ankle"), joint("right_ankle"))


@dataclass(frozen=True)
class Targets:
    """Goals of hands and feet, what must not be run into, and what is carried."""

    palms: Float[np.ndarray, "frames 2 3"]
    """World, metres; left, right."""
    R_world_wrist: Float[np.ndarray, "frames 2 3 3"]
    pull: Float[np.ndarray, "frames 2"]
    """0 where a hand is free, 1 where it holds, smooth between."""
    ankles: Float[np.ndarray, "frames 2 3"]
    """Of the base motion, world, metres."""
    soles: Float[np.ndarray, "frames 4 3"]
    """Left heel, right heel, left ball, right ball, world, metres."""
    planted: Bool[np.ndarray, "frames 4"]
    """Which of the soles stand."""
    centre: Float[np.ndarray, "frames 3"]
    """Centre of mass of the base motion, which was in balance whatever its feet seem to say."""
    T_world_prop: Float[np.ndarray, "frames 4 4"]
    low: Float[np.ndarray, "parts 3"]
    """Boxes that the prop fills, prop frame, metres."""
    high: Float[np.ndarray, "parts 3"]
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the prop may be leant on."""
    load: float
    """Mass of the prop while it is carried, kilograms (0: it stands on its own)."""


def targets_of(
    body: BodyModel,
    base: tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]],
    hands: Hands,
    T_world_prop: Float[np.ndarray, "frames 4 4"],
    parts: Sequence[Part],
    *,
    load: float = 0.0,
    leant_on: bool = False,
) -> Targets:
    """Goals of one take.

    Args:
        body: whose feet stand.
        base: root and global rotations of the motion whose feet are kept.
        hands: goals of the hands.
        T_world_prop: where the prop is.
        parts: what the prop is made of.
        load: its mass, kilograms, where it is lifted.
        leant_on: the prop is pushed or pulled, so the body may lean while a hand is on it.
    """
    root, rotations = base
    soles, joints = sole_points(body, root, rotations), joints_of(body, root, rotations)
    lean = hands.pull.max(axis=1) if leant_on else np.zeros(len(root))
    return Targets(
        palms=hands.palms,
        R_world_wrist=hands.R_world_wrist,
        pull=hands.pull,
        ankles=joints[:, _ANKLES],
        soles=soles,
        planted=foot_contacts(soles),
        centre=centre_of_mass(joints),
        T_world_prop=T_world_prop,
        low=np.stack([part.low for part in parts]),
        high=np.stack([part.high for part in parts]),
        balance=1.0 - lean,
        load=load,
    )
