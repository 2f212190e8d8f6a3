"""The skeletons motion comes in, as data: which of their joints stand for which of ours."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

_FACING_Z = np.eye(3)
_FACING_X = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


@dataclass(frozen=True, eq=False)
class SourceSkeleton:
    """How to read one family of recordings."""

    name: str
    rest_axes: Float[np.ndarray, "3 3"] | None
    """Columns: where the body's left, up and forward lie when all global rotations are the identity
    and it stands, arms in any direction; None when the local frames are arbitrary and must be
    estimated from the motion."""
    points: dict[str, str]
    """Our joint (or left_palm, right_palm) -> the source joint at that place."""
    drivers: dict[str, tuple[str, str, float]]
    """Our joint -> (a, b, w): it turns as source joint a blended towards b by w."""

    @property
    def joint_names(self) -> frozenset[str]:
        """Every joint a recording must have."""
        turning = {name for a, b, _ in self.drivers.values() for name in (a, b)}
        return frozenset(turning | set(self.points.values()))


def _both_sides(table: dict[str, str], left: str, right: str) -> dict[str, str]:
    """Our unsided joint -> source joint with '*' for the side, written out for both sides."""
    out: dict[str, str] = {}
    for ours, theirs in table.items():
        out[f"left_{ours}"] = theirs.replace("*", left)
        out[f"right_{ours}"] = theirs.replace("*", right)
    return out


def _drivers(
    trunk: dict[str, tuple[str, str, float]], limbs: dict[str, str]
) -> dict[str, tuple[str, str, float]]:
    return trunk | _same(limbs)


def _same(table: dict[str, str]) -> dict[str, tuple[str, str, float]]:
    return {ours: (theirs, theirs, 0.0) for ours, theirs in table.items()}


CMU_BVH = SourceSkeleton(
    name="cmu_bvh",
    rest_axes=_FACING_Z,
    points=_both_sides(
        {
            "hip": "*Thigh",
            "knee": "*Shin",
            "ankle": "*Foot",
            "foot": "*Foot_end",
            "shoulder": "*Shldr",
            "elbow": "*ForeArm",
            "wrist": "*Hand",
            "palm": "*Mid1",
        },
        "l",
        "r",
    ),
    drivers=_drivers(
        {
            "pelvis": ("hip", "hip", 0.0),
            "spine1": ("hip", "abdomen", 0.5),
            "spine2": ("abdomen", "chest", 0.3),
            "spine3": ("chest", "chest", 0.0),
            "neck": ("neck", "neck", 0.0),
            "head": ("head", "head", 0.0),
        },
        _both_sides(
            {
                "hip": "*Thigh",
                "knee": "*Shin",
                "ankle": "*Foot",
                "foot": "*Foot",
                "collar": "*Collar",
                "shoulder": "*Shldr",
                "elbow": "*ForeArm",
                "wrist": "*Hand",
            },
            "l",
            "r",
        ),
    ),
)
"""CMU recordings as BVH (Daz-friendly conversion): T-pose rest."""

CMU_JUMP = SourceSkeleton(
    name="cmu_jump",
    rest_axes=_FACING_X,
    points=_both_sides(
        {p: f"*_{p}" for p in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")},
        "left",
        "right",
    ),
    drivers=_drivers(
        {
            "pelvis": ("root", "root", 0.0),
            "spine1": ("root", "chest", 0.4),
            "spine2": ("root", "chest", 0.8),
            "spine3": ("chest", "chest", 0.0),
            "neck": ("chest", "neck", 0.25),
            "head": ("chest", "neck", 0.5),
        },
        _both_sides(
            {
                "hip": "*_hip",
                "knee": "*_knee",
                "ankle": "*_ankle",
                "foot": "*_ankle",
                "shoulder": "*_shoulder",
                "elbow": "*_elbow",
                "wrist": "*_elbow",
            },
            "left",
            "right",
        )
        | {"left_collar": "chest", "right_collar": "chest"},
    ),
)
"""CMU recordings with 15 joints: arms hang in the rest pose, no hands, no toes."""

O3DE = SourceSkeleton(
    name="o3de",
    rest_axes=None,
    points=_both_sides(
        {
            "hip": "*UpperLeg",
            "knee": "*LowerLeg",
            "ankle": "*Foot",
            "foot": "*Toes",
            "shoulder": "*UpperArm",
            "elbow": "*LowerArm",
            "wrist": "*Hand",
        },
        "Left",
        "Right",
    ),
    drivers=_same(
        {
            "pelvis": "Hips",
            "spine1": "Spine",
            "spine2": "Chest",
            "spine3": "UpperChest",
            "neck": "Neck",
            "head": "Head",
        }
        | _both_sides(
            {
                "hip": "*UpperLeg",
                "knee": "*LowerLeg",
                "ankle": "*Foot",
                "foot": "*Toes",
                "collar": "*Shoulder",
                "shoulder": "*UpperArm",
                "elbow": "*LowerArm",
                "wrist": "*Hand",
            },
            "Left",
            "Right",
        )
    ),
)
"""Open 3D Engine's locomotion takes: every joint has an arbitrary local frame."""

HDM05 = SourceSkeleton(
    name="hdm05",
    rest_axes=_FACING_Z,
    points=_both_sides(
        {
            "hip": "*hipjoint",
            "knee": "*femur",
            "ankle": "*tibia",
            "foot": "*foot",
            "shoulder": "*clavicle",
            "elbow": "*humerus",
            "wrist": "*wrist",
            "palm": "*hand",
        },
        "l",
        "r",
    ),
    drivers=_same(
        {
            "pelvis": "root",
            "spine1": "lowerback",
            "spine2": "upperback",
            "spine3": "thorax",
            "neck": "lowerneck",
            "head": "head",
        }
        | _both_sides(
            {
                "hip": "*femur",
                "knee": "*tibia",
                "ankle": "*foot",
                "foot": "*toes",
                "collar": "*clavicle",
                "shoulder": "*humerus",
                "elbow": "*radius",
                "wrist": "*hand",
            },
            "l",
            "r",
        )
    ),
)
"""HDM05: a joint sits at the far end of the bone of its name, which its rotation turns."""

_SIDED = {
    "hip": "Hip", "knee": "Knee", "ankle": "Ankle", "foot": "Toe", "collar": "Thorax",
    "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist", "palm": "Middle1",
}  # fmt: skip
SKILLMIMIC = SourceSkeleton(
    name="skillmimic",
    rest_axes=_FACING_Z,
    points=_both_sides({o: f"*_{t}" for o, t in _SIDED.items() if o != "collar"}, "L", "R"),
    drivers=_drivers(
        {
            "pelvis": ("Pelvis", "Pelvis", 0.0),
            "spine1": ("Torso", "Torso", 0.0),
            "spine2": ("Spine", "Spine2", 0.5),
            "spine3": ("Chest", "Chest", 0.0),
            "neck": ("Neck", "Neck", 0.0),
            "head": ("Head", "Head", 0.0),
        },
        _both_sides({o: f"*_{t}" for o, t in _SIDED.items() if o != "palm"}, "L", "R"),
    ),
)
"""SkillMimic's recordings of a person with a ball: T-pose rest, all fingers."""

SOURCE_SKELETONS: tuple[SourceSkeleton, ...] = (CMU_BVH, CMU_JUMP, O3DE, HDM05, SKILLMIMIC)
