"""Approach: where hands are while they come to what they hold, and after they have let go of it."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.config import SOLVER
from omomo_core.body.trajectory_optimization.targets import SolverTargets
from omomo_core.geometry.easing import min_jerk


def keep_approach(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
    targets: SolverTargets,
) -> SolverTargets:
    """Return targets in which hands that come or go stay on the path of the initial motion.

    It must reach what it holds, as synthetic people do: where it does not, the path jumps.

    Args:
        body: whose hands.
        root: pelvis of the initial motion, world, metres.
        rotations: its global R_world_joint.
        targets: to change.
    """
    firm = targets.hold >= 1.0
    palms = np.where(firm[..., None], targets.palms, _palms(body, root, rotations))
    return replace(targets, palms=palms, hold=np.where(firm, 1.0, _pull(targets)))


def blend_approach(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
    targets: SolverTargets,
) -> SolverTargets:
    """Return targets in which hands come from the path of the initial motion, and go back to it.

    Sampled people often do not reach what they hold before they are optimised. The arguments are those of
    `keep_approach`.
    """
    palms = _palms(body, root, rotations)
    blended = palms + targets.hold[..., None] * (targets.palms - palms)
    return replace(targets, palms=blended, hold=_pull(targets))


def _palms(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
) -> Float[np.ndarray, "*b frames 2 3"]:
    return joints_of(body, root, rotations)[..., 22:, :]


def _pull(targets: SolverTargets) -> Float[np.ndarray, "*b frames 2"]:
    """Return how firmly hands are kept on their path: wholly, long before they touch."""
    return min_jerk(targets.hold / SOLVER.approach_hold)
