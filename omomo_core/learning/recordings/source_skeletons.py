"""The skeletons motion comes in, and how rigs are recognised by the names of their joints.

Mixamo, MotionBuilder and CMU conversions, Rokoko, Xsens, Perception Neuron, Unreal's mannequin, 3ds Max
Biped, VRM and their like name the same bones with few words. A name is cut into a side and a word
(``mixamorig:LeftUpLeg``, ``thigh_l`` and ``Bip01 L Thigh`` become left upleg, left thigh, left thigh),
and the word is looked up. How the bones lie at rest is read from the rest pose itself.
"""

import hashlib
import re
from collections.abc import Sequence
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


_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}
_LIMB_WORDS: dict[str, tuple[str, ...]] = {
    "knee": ("knee", "shin", "calf", "lowerleg", "lowleg", "tibia", "leg"),
    "hip": ("upleg", "upperleg", "thigh", "femur", "hip", "leg", "hipjoint"),
    "ankle": ("foot", "ankle"),
    "foot": ("toebase", "toe", "toes", "toe0", "ball"),
    "elbow": ("forearm", "lowerarm", "lowarm", "elbow", "radius"),
    "shoulder": ("upperarm", "uparm", "arm", "shldr", "humerus", "shoulder"),
    "collar": ("collar", "clavicle", "shoulder", "scapula"),
    "wrist": ("hand", "wrist"),
    "palm": (
        "handmiddle1", "inhandmiddle", "middle1", "middle01", "fingermiddle1", "middleproximal",
        "mid1", "finger2",
    ),
}  # fmt: skip
"""Best first; a joint that an earlier part took is not taken again."""
_NEEDED = ("knee", "hip", "ankle", "elbow", "shoulder", "wrist")
_HIPS = ("hips", "pelvis", "hip", "root", "reference")
_NECK = ("neck", "neck1", "neck01", "lowerneck")
_LONG_ENOUGH = 0.03
"""Part of the leg's length: a shorter end site shows no direction."""
_STANDING = 0.8
"""Cosine between thighs and straight down beneath which a rest pose is nobody standing."""


def recognise_rig(
    names: Sequence[str], parents: Sequence[int], rest: Float[np.ndarray, "joints 3"]
) -> SourceSkeleton | None:
    """The joints of a known rig, or None when too many are missing.

    Args:
        names: of the joints.
        parents: index of each joint's parent, -1 for the root.
        rest: positions when all global rotations are the identity, any unit and axes.
    """
    words = [_side_and_word(name) for name in names]
    sided = {side: _limbs(words, side) for side in ("left", "right")}
    hips = _first(words, None, _HIPS, set())
    head = _first(words, None, ("head",), set())
    if hips is None or head is None or any(p not in s for s in sided.values() for p in _NEEDED):
        return None
    trunk = _path(parents, head, hips)
    if trunk is None:
        return None
    joints = {f"{side}_{part}": j for side, found in sided.items() for part, j in found.items()}
    axes = _rest_axes(rest, joints, hips, head)
    points = _points(names, parents, rest, joints)
    drivers = _trunk_drivers(names, words, trunk, blended=axes is not None)
    for side in ("left", "right"):
        drivers |= _limb_drivers(names, joints, side, drivers["spine3"][0])
    lying = np.round(_directions(rest, parents), 1) + 0.0
    mark = hashlib.sha256(repr((tuple(names), lying.tolist())).encode()).hexdigest()[:6]
    return SourceSkeleton(f"rig_{mark}", axes, points, drivers)


def upright(
    skeleton: SourceSkeleton, names: Sequence[str], positions: Float[np.ndarray, "frames joints 3"]
) -> Float[np.ndarray, "3"]:
    """Mean direction from hips to shoulders, unit length, in the recording's own axes."""
    at = {n: positions[:, list(names).index(n)] for n in skeleton.points.values()}
    shoulders = sum(at[skeleton.points[f"{s}_shoulder"]] for s in ("left", "right"))
    hips = sum(at[skeleton.points[f"{s}_hip"]] for s in ("left", "right"))
    total = np.asarray(shoulders - hips).mean(axis=0)
    return total / max(float(np.linalg.norm(total)), 1e-12)


def _side_and_word(name: str) -> tuple[str | None, str]:
    """Which side a joint is on, and what it is called there, in small letters."""
    bare = re.sub(
        r"^(?:.*:|bip\d+|mixamorig\d*_|robot_|character\d*_|j_bip_|(?:def|org)-)",
        "",
        name,
        flags=re.I,
    )
    parts = [p.lower() for p in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", bare)]
    side = next((_SIDES[p] for p in parts if p in _SIDES), None)
    word = "".join(p for p in parts if p not in _SIDES and p not in ("c", "b"))
    known = {w for options in _LIMB_WORDS.values() for w in options}
    if side is None and word[:1] in ("l", "r") and word[1:] in known and word not in known:
        return _SIDES[word[0]], word[1:]
    return side, word


def _first(
    words: Sequence[tuple[str | None, str]],
    side: str | None,
    options: Sequence[str],
    taken: set[int],
) -> int | None:
    for option in options:
        for j, found in enumerate(words):
            if found == (side, option) and j not in taken:
                return j
    return None


def _limbs(words: Sequence[tuple[str | None, str]], side: str) -> dict[str, int]:
    """Our part (knee, hip...) -> joint, for one side."""
    found: dict[str, int] = {}
    for part, options in _LIMB_WORDS.items():
        joint = _first(words, side, options, set(found.values()))
        if joint is not None:
            found[part] = joint
    return found


def _path(parents: Sequence[int], tip: int, base: int) -> list[int] | None:
    """Joints from `base` up to `tip`, both included; None when `tip` does not hang on `base`."""
    path = [tip]
    while path[-1] != base:
        if parents[path[-1]] < 0:
            return None
        path.append(parents[path[-1]])
    return path[::-1]


def _directions(
    rest: Float[np.ndarray, "joints 3"], parents: Sequence[int]
) -> Float[np.ndarray, "joints 3"]:
    bones = rest - rest[[max(p, 0) for p in parents]]
    return bones / np.linalg.norm(bones, axis=-1, keepdims=True).clip(1e-9)


def _rest_axes(
    rest: Float[np.ndarray, "joints 3"], joints: dict[str, int], hips: int, head: int
) -> Float[np.ndarray, "3 3"] | None:
    """Our axes (x left, y up, z forward) in a rest pose that stands; None when it does not."""
    up = _unit(rest[head] - rest[hips])
    left = _unit(rest[joints["left_hip"]] - rest[joints["right_hip"]])
    thighs = [
        _unit(rest[joints[f"{side}_knee"]] - rest[joints[f"{side}_hip"]])
        for side in ("left", "right")
    ]
    if max(float(t @ up) for t in thighs) > -_STANDING or abs(left @ up) > 0.3:
        return None
    # The legs lie truer to the vertical than the back, which is curved.
    up = _unit(-thighs[0] - thighs[1])
    axis = np.zeros(3)
    axis[np.abs(up).argmax()] = np.sign(up[np.abs(up).argmax()])
    up = axis if up @ axis > 0.94 else up
    left = _unit(left - up * (left @ up))
    return np.stack([left, up, np.cross(left, up)], axis=-1)


def _points(
    names: Sequence[str],
    parents: Sequence[int],
    rest: Float[np.ndarray, "joints 3"],
    joints: dict[str, int],
) -> dict[str, str]:
    """Our joint -> theirs; toes and palms may be end sites, where those are long enough."""
    points = {ours: names[j] for ours, j in joints.items() if not ours.endswith("collar")}
    leg = np.linalg.norm(rest[joints["left_hip"]] - rest[joints["left_ankle"]])
    for side in ("left", "right"):
        for ours, above in (("foot", "ankle"), ("palm", "wrist")):
            end = f"{names[joints[f'{side}_{above}']]}_end"
            if f"{side}_{ours}" not in points and end in names:
                j, i = list(names).index(end), joints[f"{side}_{above}"]
                bone = rest[j] - rest[i]
                # The hand goes on where the forearm ends; some end sites point anywhere.
                astray = ours == "palm" and _unit(bone) @ _unit(rest[i] - rest[parents[i]]) < 0.5
                if np.linalg.norm(bone) > _LONG_ENOUGH * leg and not astray:
                    points[f"{side}_{ours}"] = end
    return points


def _trunk_drivers(
    names: Sequence[str],
    words: Sequence[tuple[str | None, str]],
    trunk: list[int],
    *,
    blended: bool,
) -> dict[str, tuple[str, str, float]]:
    """Our three spine joints spread over however many theirs has, neck and head.

    Blending two joints needs local frames that agree at rest.
    """
    neck = next((k for k, j in enumerate(trunk) if k > 0 and words[j][1] in _NECK), len(trunk) - 1)
    back = [names[j] for j in trunk[:neck]]
    drivers: dict[str, tuple[str, str, float]] = {}
    for k, ours in enumerate(("pelvis", "spine1", "spine2", "spine3")):
        place = k / 3 * (len(back) - 1)
        low = int(place)
        high, weight = min(low + 1, len(back) - 1), place - low
        if not blended:
            low, weight = round(place), 0.0
        drivers[ours] = (back[low], back[high], weight)
    for ours, theirs in (("neck", names[trunk[neck]]), ("head", names[trunk[-1]])):
        drivers[ours] = (theirs, theirs, 0.0)
    return drivers


def _limb_drivers(
    names: Sequence[str], joints: dict[str, int], side: str, chest: str
) -> dict[str, tuple[str, str, float]]:
    drivers: dict[str, tuple[str, str, float]] = {}
    for part in ("hip", "knee", "ankle", "foot", "collar", "shoulder", "elbow", "wrist"):
        ours = f"{side}_{part}"
        # Toes that are no joint of their own turn with the foot, missing collars with the chest.
        joint = joints.get(ours, joints[f"{side}_ankle"] if part == "foot" else None)
        theirs = chest if joint is None else names[joint]
        drivers[ours] = (theirs, theirs, 0.0)
    return drivers


def _unit(v: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return v / max(float(np.linalg.norm(v)), 1e-12)
