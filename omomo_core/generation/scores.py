"""Judging a sample without knowing the truth: what a person who moves an object cannot do."""

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.generation.take import Take
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, HumanMotion

TRUNK = (0, 1, 2, 3, 4, 5, 6, 9, 12, 15)
"""Joints that lie deep in the body: pelvis, hips, knees, spine, neck, head."""


def score(
    human: HumanMotion,
    take: Take,
    miss: Float[np.ndarray, "frames 2"],
    moving: Bool[np.ndarray, " frames"],
) -> dict[str, float]:
    """Faults of one sample; "total" is what samples are ranked by, less is better.

    Args:
        human: the sample.
        take: the object it moves.
        miss: distance of each holding palm from its place, metres.
        moving: frames in which somebody must hold the object.
    """
    held = human.hand_contact > 0.5
    unheld = float((moving & ~held.any(axis=1)).sum() / max(1, moving.sum()))
    faults = {
        "unheld": unheld,
        "miss_cm": 100 * float(miss[held].mean()) if held.any() else 0.0,
        "skate_cm_s": _skate(human),
        "inside_cm": 100 * _inside(human, take),
        "jerk_m_s3": _jerk(human),
    }
    weights = {
        "unheld": 20.0,
        "miss_cm": 1.0,
        "skate_cm_s": 0.2,
        "inside_cm": 1.0,
        "jerk_m_s3": 0.02,
    }
    return {**faults, "total": sum(weights[k] * v for k, v in faults.items())}


def must_be_held(take: Take) -> Bool[np.ndarray, " frames"]:
    """Frames in which the object moves: nothing here moves by itself."""
    speed = np.linalg.norm(take.velocity, axis=1)
    return (speed > 0.10) | (np.linalg.norm(take.spin, axis=1) > 0.5)


def _skate(human: HumanMotion) -> float:
    """Mean horizontal speed of planted ankles and toes, cm/s."""
    feet = human.joints[:, (7, 8, 10, 11), :2]
    speed = 100 * FPS * np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    planted = human.foot_contact[1:] > 0.5
    return float(speed[planted].mean()) if planted.any() else 0.0


def _jerk(human: HumanMotion) -> float:
    if len(human.joints) < 4:
        return 0.0
    return float(np.linalg.norm(np.diff(human.joints, n=3, axis=0), axis=-1).mean() * FPS**3)


def _inside(human: HumanMotion, take: Take) -> float:
    """Mean depth of trunk joints inside the object, metres, by the nearest surface's normal."""
    T_object_world = inverse(take.motion.T_world_object)
    points = human.joints[:, TRUNK]
    local = np.einsum("fij,fpj->fpi", T_object_world[:, :3, :3], points)
    local += T_object_world[:, None, :3, 3]
    _, nearest = take.surface.tree.query(local)
    out = local - take.surface.points[nearest]
    depth = -np.einsum("fpi,fpi->fp", out, take.surface.normals[nearest])
    return float(np.clip(depth, 0, None).max(axis=1).mean())
