"""A skeleton that shall carry the motion: its bones, and which of them are which of ours."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_app.exports.bone_names import BONE_NAMES
from capture_app.exports.take import Y_UP, Skeleton
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError

NEEDED = ("pelvis", "head", *(f"{side}_{part}" for side in ("left", "right") for part in (
    "hip", "knee", "ankle", "shoulder", "elbow", "wrist")))  # fmt: skip
"""Joints without which a skeleton is nobody's."""
_SOLE = 0.034
"""Height of the lowest joint of a foot over the sole, as a part of the leg's length."""
_ON_FLOOR = 0.25
"""Of the leg's length: a lowest joint that near above the file's origin stands on its floor."""


@dataclass(frozen=True)
class Target:
    """A skeleton standing at rest in our world."""

    name: str
    skeleton: Skeleton
    joints: dict[str, int]
    """Our joint -> index of theirs; those of NEEDED at least."""
    smplx: BodyModel | None = None
    """The SMPL-X model that it was made of."""


@dataclass(frozen=True)
class RawBones:
    """Bones as a file has them, in its axes."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: Float[np.ndarray, "joints 3"]
    """At rest, any unit."""
    rotations: Float[np.ndarray, "joints 3 3"]
    """At rest, from the joint's axes to the file's."""


def recognised(names: Sequence[str]) -> dict[str, int]:
    """Our joint -> index of the bone that has its name in the map that fits best.

    Prefixes before a colon, "mixamorig", case and everything but letters and digits do not count.
    """
    plain = [_plain(name) for name in names]
    maps = [{ours: _plain(b) for ours, b in table.of.items()} for table in BONE_NAMES.values()]
    found = [{ours: plain.index(b) for ours, b in m.items() if b in plain} for m in maps]
    return max(found, key=len)


def standing(name: str, bones: RawBones, joints: Mapping[str, int], where: str) -> Target:
    """A file's bones put upright on the floor of our world, facing -y, in metres.

    Args:
        name: what to call the target.
        bones: at rest the body stands, arms in any direction.
        joints: our joint -> bone.
        where: the file, for messages.

    Raises:
        InputError: "skeleton-unknown" when needed bones were not found, "skeleton-not-standing".
    """
    missing = [ours for ours in NEEDED if ours not in joints]
    if missing:
        raise InputError(
            "skeleton-unknown",
            f"The skeleton lacks a bone for {', '.join(missing[:4])}"
            + (f" and {len(missing) - 4} more." if len(missing) > 4 else "."),
            where=where,
            fix=f"Name its bones as one of {', '.join(BONE_NAMES)} does; a VRM file says itself.",
        )
    at = {ours: bones.positions[k] for ours, k in joints.items()}
    R = Y_UP.T @ _upright(at, where).T
    leg = _leg(at)
    metres = 0.01 if leg > 10.0 else 1.0
    points = bones.positions @ R.T
    lowest = points[[joints[k] for k in joints if k.endswith(("ankle", "foot"))], 2].min()
    floor = 0.0 if 0.0 < lowest < _ON_FLOOR * leg else lowest - _SOLE * leg
    pelvis = points[joints["pelvis"]]
    points = (points - [pelvis[0], pelvis[1], floor]) * metres
    skeleton = Skeleton(bones.names, bones.parents, points, R @ bones.rotations, joints["pelvis"])
    return Target(name, skeleton, dict(joints))


def _plain(name: str) -> str:
    bare = re.sub(r"[^a-z0-9]", "", name.rsplit(":", 1)[-1].lower())
    return re.sub(r"^mixamorig\d*", "", bare)


def _leg(at: Mapping[str, Float[np.ndarray, "3"]]) -> float:
    bones = (("left_hip", "left_knee"), ("left_knee", "left_ankle"))
    return sum(float(np.linalg.norm(at[b] - at[a])) for a, b in bones)


def _upright(at: Mapping[str, Float[np.ndarray, "3"]], where: str) -> Float[np.ndarray, "3 3"]:
    """Columns: left, up and forward of a standing body in the file's axes."""
    feet = (at["left_ankle"] + at["right_ankle"]) / 2
    up = _snapped(at["head"] - feet)
    left = at["left_hip"] - at["right_hip"]
    left = _snapped(left - up * (left @ up))
    knees = [(at[f"{s}_hip"] - at[f"{s}_ankle"]) @ up / _leg(at) for s in ("left", "right")]
    if min(knees) < 0.7 or not np.isfinite(left).all():
        raise InputError(
            "skeleton-not-standing",
            "In its rest pose the skeleton does not stand upright, so there is nothing to compare "
            "with.",
            where=where,
            fix="Export it again with a T-pose or an A-pose as the rest pose.",
        )
    return np.stack([left, up, np.cross(left, up)], axis=1)


def _snapped(v: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """A direction of unit length; the axis that is nearly it, if one is."""
    v = v / max(float(np.linalg.norm(v)), 1e-12)
    axis = np.zeros(3)
    axis[np.abs(v).argmax()] = np.sign(v[np.abs(v).argmax()])
    return axis if v @ axis > 0.97 else v
