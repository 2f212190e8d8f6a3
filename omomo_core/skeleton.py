"""Joint names and order shared by the whole project: SMPL-X's 22 body joints, 30 finger joints, 2 palms."""

BODY_JOINTS: tuple[str, ...] = (
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
)
BODY_PARENTS: tuple[int, ...] = (
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19,
)  # fmt: skip

_FINGERS = ("index", "middle", "pinky", "ring", "thumb")
FINGER_JOINTS: tuple[str, ...] = tuple(
    f"{side}_{finger}{k}" for side in ("left", "right") for finger in _FINGERS for k in (1, 2, 3)
)

ALL_JOINTS: tuple[str, ...] = BODY_JOINTS + FINGER_JOINTS
"""The 52 joints that bodies and exports carry."""


def _finger_parents() -> tuple[int, ...]:
    parents: list[int] = []
    for i in range(len(FINGER_JOINTS)):
        wrist = 20 if i < 15 else 21
        parents.append(wrist if i % 3 == 0 else 22 + i - 1)
    return tuple(parents)


ALL_PARENTS: tuple[int, ...] = BODY_PARENTS + _finger_parents()

PALM_JOINTS: tuple[int, int] = (
    ALL_JOINTS.index("left_middle1"),
    ALL_JOINTS.index("right_middle1"),
)
"""The palms are the bases of the middle fingers (left, right), as in the paper."""

MODEL_PARENTS: tuple[int, ...] = (*BODY_PARENTS, 20, 21)
"""Parents of the model's 24 joints: the 22 body joints, then left palm, right palm (on the wrists)."""
MODEL_ABOVE: tuple[int, ...] = tuple(max(parent, 0) for parent in MODEL_PARENTS)
"""The same, as indices: the pelvis is above itself."""


def joint(name: str) -> int:
    """Index of a joint name in ALL_JOINTS (body joints have the same index in BODY_JOINTS)."""
    return ALL_JOINTS.index(name)
