"""What other programs call our joints."""

from dataclasses import dataclass

from capture_app.commands.export import Bones
from omomo_core.skeleton import ALL_JOINTS

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


BONE_NAMES: dict[Bones, BoneNames] = {
    Bones.smplx: BoneNames({name: name for name in ALL_JOINTS}),
    Bones.mixamo: BoneNames(_mixamo()),
    Bones.unreal: BoneNames(_unreal(), root="root"),
    Bones.unity: BoneNames(_unity()),
    Bones.vrm: BoneNames(_vrm()),
}
"""Every joint of ALL_JOINTS has a name in each."""
