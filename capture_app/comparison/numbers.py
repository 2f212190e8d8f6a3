"""The numbers under the pictures: what is measured of a motion, with and without the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capture_app.comparison.motion import Motion
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.evaluation.metrics import contact_scores, foot_measures, joint_errors
from omomo_core.learning.evaluation.truth import Touching
from omomo_core.motion import FPS
from render.comparison import Number


@dataclass(frozen=True)
class Measure:
    """How a figure is called and written."""

    name: str
    unit: str
    digits: int
    more_is_better: bool = False


MEASURES = {
    "held_percent": Measure("moving object held", "%", 0, more_is_better=True),
    "slip_cm_s": Measure("hands slip", "cm/s", 1),
    "penetration_cm": Measure("body without hands in object", "cm", 2),
    "hand_penetration_cm": Measure("hands in object", "cm", 2),
    "foot_sliding_cm": Measure("foot sliding", "cm", 2),
    "jerk_m_s3": Measure("jerk", "m/s3", 0),
    "mpjpe_cm": Measure("MPJPE", "cm", 1),
    "hand_jpe_cm": Measure("HandJPE", "cm", 1),
    "t_root_cm": Measure("T_root", "cm", 1),
    "contact_f1": Measure("contact F1", "", 2, more_is_better=True),
}
"""In the order in which they are shown; the last four need the truth."""

Figures = dict[str, float]


def own_figures(motion: Motion) -> Figures:
    """What can be measured of a motion alone, alike for results and recorded people.

    Held: share of the frames in which somebody must hold the object, with a palm within 5 cm of it;
    left out where nobody must. Slip: mean speed of holding palms over the object. Penetration and
    foot sliding: as `omocap evaluate` has them. Jerk: mean of all joints.
    """
    touching, thing = Touching(motion.object_motion), ObjectModel(motion.object_motion.mesh, 1.0)
    T, joints = motion.object_motion.T_world_object, motion.human.joints
    must = thing.clip(T).must_hold
    touched = touching.palms(joints[:, 22:].astype(np.float64))[must]
    deep = touching.penetration(motion.human, motion.body)
    held = {"held_percent": 100 * float(touched.any(axis=1).mean())} if len(touched) else {}
    return {
        **held,
        **_slip(motion),
        "penetration_cm": deep["penetration_cm"],
        "hand_penetration_cm": deep["hand_penetration_cm"],
        "foot_sliding_cm": foot_measures(joints)["foot_sliding_cm"],
        "jerk_m_s3": _jerk(joints),
    }


def figures_against(motion: Motion, truth: Motion) -> Figures:
    """Distances from the truth, over frames that both have (as many, and of one world)."""
    touching = Touching(truth.object_motion)
    found, true = (
        touching.palms(m.human.joints[:, 22:].astype(np.float64)) for m in (motion, truth)
    )
    return {
        **joint_errors(motion.human.joints, truth.human.joints),
        "contact_f1": contact_scores(found, true)["contact_f1"],
    }


def shown(figures: Sequence[Mapping[str, float]]) -> list[tuple[Number, ...]]:
    """The figures of several motions as they are written; the best of each is marked.

    None is marked where all are written alike.
    """
    written = [
        {k: f"{row[k]:.{m.digits}f} {m.unit}".strip() for k, m in MEASURES.items() if k in row}
        for row in figures
    ]
    best: dict[str, str] = {}
    for key, measure in MEASURES.items():
        values = {
            row[key]: text[key] for row, text in zip(figures, written, strict=True) if key in row
        }
        if len(set(values.values())) > 1:
            best[key] = values[(max if measure.more_is_better else min)(values)]
    return [
        tuple(Number(MEASURES[k].name, text, text == best.get(k)) for k, text in row.items())
        for row in written
    ]


def _slip(motion: Motion) -> Figures:
    """Nothing where no hand ever holds."""
    palms = to_local(motion.object_motion.T_world_object, motion.human.joints[:, 22:])
    speed = 100 * FPS * np.linalg.norm(np.diff(palms, axis=0), axis=-1)
    both = motion.contact[1:] & motion.contact[:-1]
    return {"slip_cm_s": float(speed[both].mean())} if both.any() else {}


def _jerk(joints: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(joints, n=3, axis=0), axis=-1).mean() * FPS**3)
