"""Scores of a sample without ground truth: faults that no person who moves an object has."""

from dataclasses import asdict

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.generation.person import Person
from omomo_core.generation.selection.config import SCORE, SCORE_WEIGHTS
from omomo_core.generation.selection.speed_limits import speed_excess
from omomo_core.motion import FPS, HumanMotion

FEET = (7, 8, 10, 11)
"""Ankles and toes, in the order of a motion's foot contacts."""
_WEIGHTS: dict[str, float] = asdict(SCORE_WEIGHTS)


def score(person: Person, must_hold: Bool[np.ndarray, " frames"]) -> dict[str, float]:
    """Return the faults of one sample; "total", their weighted sum, ranks the samples: less is better.

    Args:
        person: the sample.
        must_hold: frames in which somebody must hold the object.
    """
    human, held = person.human, person.human.hand_contact > 0.5
    faults = {
        "unheld": float((must_hold & ~held.any(axis=1)).sum() / max(1, must_hold.sum())),
        "miss_cm": 100 * float(person.miss[held].mean()) if held.any() else 0.0,
        "skate_cm_s": _skate(human),
        "inside_cm": 100 * float(person.depth.mean()),
        "floating": float((_lowest_foot(human) > SCORE.floating_height).mean()),
        "jerk_m_s3": _jerk(human.joints),
        "leaping": speed_excess(human),
    }
    return {**faults, "total": sum(_WEIGHTS[k] * v for k, v in faults.items())}


def _skate(human: HumanMotion) -> float:
    """Return the mean horizontal speed of planted ankles and toes, cm/s."""
    feet = human.joints[:, FEET, :2]
    speed = 100 * FPS * np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    planted = human.foot_contact[1:] > 0.5
    return float(speed[planted].mean()) if planted.any() else 0.0


def _lowest_foot(human: HumanMotion) -> Float[np.ndarray, " frames"]:
    """Return the height of the lower toe joint above its floor in the whole motion, metres."""
    lowest = human.joints[:, FEET[2:], 2].min(axis=1)
    return lowest - np.quantile(lowest, SCORE.floor_quantile)


def _jerk(joints: Float[np.ndarray, "frames 24 3"]) -> float:
    if len(joints) < 4:
        return 0.0
    return float(np.linalg.norm(np.diff(joints, n=3, axis=0), axis=-1).mean() * FPS**3)
