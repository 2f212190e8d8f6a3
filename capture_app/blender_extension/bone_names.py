"""The names that programs give the bones of a person, and whose names a skeleton's bones have.

The Blender extension holds this file too: it imports nothing of omocap.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

NEEDED = ("pelvis", "head", *(f"{side}_{part}" for side in ("left", "right") for part in (
    "hip", "knee", "ankle", "shoulder", "elbow", "wrist")))  # fmt: skip
"""Joints without which a skeleton is nobody's."""
_FINGERS = ("thumb", "index", "middle", "ring", "pinky")


@dataclass(frozen=True)
class BoneNames:
    """The names of one program."""

    of: dict[str, str]
    """Our joint -> their bone."""
    root: str | None = None
    """A bone on the floor that the hips hang on, where the program wants one."""


def _both_sides(limbs: dict[str, str], left: str, right: str) -> dict[str, str]:
    """Bones of a pattern with * for the side."""
    sides = (("left", left), ("right", right))
    return {f"{s}_{k}": v.replace("*", theirs) for k, v in limbs.items() for s, theirs in sides}


def _fingers(pattern: str, words: tuple[str, ...], links: tuple[str, ...]) -> dict[str, str]:
    """Patterns of all finger bones: {finger} and {link} are replaced."""
    return {
        f"{ours}{k}": pattern.format(finger=word, link=link)
        for ours, word in zip(_FINGERS, words, strict=True)
        for k, link in enumerate(links, start=1)
    }


def _mixamo() -> dict[str, str]:
    limbs = {
        "hip": "*UpLeg", "knee": "*Leg", "ankle": "*Foot", "foot": "*ToeBase",
        "collar": "*Shoulder", "shoulder": "*Arm", "elbow": "*ForeArm", "wrist": "*Hand",
    }  # fmt: skip
    words = ("Thumb", "Index", "Middle", "Ring", "Pinky")
    limbs |= _fingers("*Hand{finger}{link}", words, ("1", "2", "3"))
    trunk = {
        "pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2",
        "neck": "Neck", "head": "Head",
    }  # fmt: skip
    names = trunk | _both_sides(limbs, "Left", "Right")
    return {ours: f"mixamorig:{theirs}" for ours, theirs in names.items()}


def _unreal() -> dict[str, str]:
    """Manny has five spine bones: ours are the first, the middle and the last of them."""
    limbs = {
        "hip": "thigh_*", "knee": "calf_*", "ankle": "foot_*", "foot": "ball_*",
        "collar": "clavicle_*", "shoulder": "upperarm_*", "elbow": "lowerarm_*", "wrist": "hand_*",
    }  # fmt: skip
    limbs |= _fingers("{finger}_{link}_*", _FINGERS, ("01", "02", "03"))
    trunk = {
        "pelvis": "pelvis", "spine1": "spine_01", "spine2": "spine_03", "spine3": "spine_05",
        "neck": "neck_01", "head": "head",
    }  # fmt: skip
    return trunk | _both_sides(limbs, "l", "r")


def _unity() -> dict[str, str]:
    limbs = {
        "hip": "*UpperLeg", "knee": "*LowerLeg", "ankle": "*Foot", "foot": "*Toes",
        "collar": "*Shoulder", "shoulder": "*UpperArm", "elbow": "*LowerArm", "wrist": "*Hand",
    }  # fmt: skip
    words = ("Thumb", "Index", "Middle", "Ring", "Little")
    limbs |= _fingers("*{finger}{link}", words, ("Proximal", "Intermediate", "Distal"))
    trunk = {
        "pelvis": "Hips", "spine1": "Spine", "spine2": "Chest", "spine3": "UpperChest",
        "neck": "Neck", "head": "Head",
    }  # fmt: skip
    return trunk | _both_sides(limbs, "Left", "Right")


def _vrm() -> dict[str, str]:
    """VRM 1.0's humanoid bones: Unity's in camel case, but a thumb begins with its metacarpal."""
    names = {ours: theirs[0].lower() + theirs[1:] for ours, theirs in _unity().items()}
    for side in ("left", "right"):
        for k, link in enumerate(("Metacarpal", "Proximal", "Distal"), start=1):
            names[f"{side}_thumb{k}"] = f"{side}Thumb{link}"
    return names


def _rigify(prefix: str) -> dict[str, str]:
    """Bones of the human metarig, or those of the rig made from it that deform the skin."""
    limbs = {
        "hip": "thigh.*", "knee": "shin.*", "ankle": "foot.*", "foot": "toe.*",
        "collar": "shoulder.*", "shoulder": "upper_arm.*", "elbow": "forearm.*", "wrist": "hand.*",
    }  # fmt: skip
    words = ("thumb", "f_index", "f_middle", "f_ring", "f_pinky")
    limbs |= _fingers("{finger}.{link}.*", words, ("01", "02", "03"))
    trunk = {
        "pelvis": "spine", "spine1": "spine.001", "spine2": "spine.002", "spine3": "spine.003",
        "neck": "spine.004", "head": "spine.006",
    }  # fmt: skip
    names = trunk | _both_sides(limbs, "L", "R")
    return {ours: f"{prefix}{theirs}" for ours, theirs in names.items()}


def _daz() -> dict[str, str]:
    """Poser's and DAZ's older bones, which the BVH files of three.js and CMU's conversions have."""
    limbs = {
        "hip": "*Thigh", "knee": "*Shin", "ankle": "*Foot", "foot": "*Toe",
        "collar": "*Collar", "shoulder": "*Shldr", "elbow": "*ForeArm", "wrist": "*Hand",
    }  # fmt: skip
    words = ("Thumb", "Index", "Mid", "Ring", "Pinky")
    limbs |= _fingers("*{finger}{link}", words, ("1", "2", "3"))
    trunk = {"pelvis": "hip", "spine1": "abdomen", "spine3": "chest", "neck": "neck"}
    return trunk | {"head": "head"} | _both_sides(limbs, "l", "r")


JOINTS = tuple(_mixamo())
"""The joints that have names: those of SMPL-X's body and hands, in no other's order."""
BONE_NAMES: dict[str, BoneNames] = {
    "smplx": BoneNames({name: name for name in JOINTS}),
    "mixamo": BoneNames(_mixamo()),
    "unreal": BoneNames(_unreal(), root="root"),
    "unity": BoneNames(_unity()),
    "vrm": BoneNames(_vrm()),
}
"""Names that an export can have; every joint of ours has one in each."""
_KNOWN = {
    **{name: table.of for name, table in BONE_NAMES.items()},
    "rigify": _rigify("DEF-"),
    "metarig": _rigify(""),
    "daz": _daz(),
}
"""Names that are recognised; three.js has Mixamo's without their colon."""
NAMED_AS = "Mixamo, Unreal, Unity, VRM, Rigify, DAZ or SMPL-X"
"""The same in words, for messages."""


def recognised(names: Sequence[str]) -> dict[str, int]:
    """Our joint -> index of the bone that has its name in the table that fits best.

    Prefixes before a colon, "mixamorig", case and everything but letters and digits do not count.
    """
    plain = [_plain(name) for name in names]
    tables = [{ours: _plain(b) for ours, b in table.items()} for table in _KNOWN.values()]
    candidates = [{ours: plain.index(b) for ours, b in t.items() if b in plain} for t in tables]
    return max(candidates, key=len)


def _plain(name: str) -> str:
    bare = re.sub(r"[^a-z0-9]", "", name.rsplit(":", 1)[-1].lower())
    return re.sub(r"^mixamorig\d*", "", bare)
