"""What the polish of a synthetic clip has to satisfy."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import sole_points
from omomo_core.body.trajectory_optimization.anatomy import centre_of_mass
from omomo_core.body.trajectory_optimization.obstacle import BoxObstacle
from omomo_core.body.trajectory_optimization.targets import SolverTargets
from omomo_core.learning.recordings.grounding import foot_contacts
from omomo_core.learning.synthesis.hands import Hands
from omomo_core.learning.synthesis.shapes import SolidPart
from omomo_core.skeleton import joint

_ANKLES = (joint("left_ankle"), joint("right_ankle"))


def targets_of(
    body: BodyModel,
    base: tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]],
    hands: Hands,
    T_world_prop: Float[np.ndarray, "frames 4 4"],
    parts: Sequence[SolidPart],
    *,
    load: float = 0.0,
    leant_on: bool = False,
) -> SolverTargets:
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
    return SolverTargets(
        palms=hands.palms,
        R_world_wrist=hands.R_world_wrist,
        hold=hands.pull,
        ankles=joints[:, _ANKLES],
        soles=soles,
        planted=foot_contacts(soles),
        centre=centre_of_mass(joints),
        T_world_object=T_world_prop,
        obstacle=boxes_of(parts),
        balance=1.0 - lean,
        carried_mass=load,
    )


def boxes_of(parts: Sequence[SolidPart]) -> BoxObstacle:
    """The boxes that a prop fills."""
    corners = (np.stack([part.low for part in parts]), np.stack([part.high for part in parts]))
    return BoxObstacle(*(torch.as_tensor(c, dtype=torch.float32) for c in corners))
