"""BVH: the person in one file, the object in a second one beside it.

BVH knows one skeleton a file and no meshes. Maya, MotionBuilder and most scripts read a single ROOT
only, so the object is a skeleton of one bone in a file of its own, with the same clock and axes. The
format has no rest rotations: at rest every joint's axes are the file's, and offsets alone say how the
bones lie.

Programs disagree about a joint that has both an offset and a position: some add the two, some take the
position alone. So only the root has a position, and its offset is 0: what stands above the hips is left
out, as is what does not hang on them.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_app.exports.exported_take import Skeleton, Take

_ORDER = "ZXY"
"""Order of rotations, first to last as the file has them; what MotionBuilder and the CMU files use."""
_CHANNELS = "Zrotation Xrotation Yrotation"
_DIGITS = 6
_END = 0.3
"""Length of the bone at the end of a limb, as a part of the bone before it."""


def write_bvh(path: Path, object_path: Path, take: Take) -> None:
    """Write the person's file and the object's.

    Args:
        path: of the person: joints below one root, whose position and rotation are the motion
            through the world.
        object_path: of the object: a root named "object" at the mesh's origin.
        take: in the axes and units of the files (usually y up, centimetres).
    """
    bones, kept = _from_hips(take.skeleton)
    turns = take.rotations[:, kept] @ bones.rotations.swapaxes(-1, -2)
    path.write_text(_text(bones, take.positions[:, kept], turns, take.fps), encoding="utf-8")
    thing = _object_bone(take)
    T = take.T_world_object
    object_path.write_text(
        _text(thing, T[:, None, :3, 3], T[:, None, :3, :3], take.fps), encoding="utf-8"
    )


def _from_hips(bones: Skeleton) -> tuple[Skeleton, list[int]]:
    """Return the hips with all that hangs on them, and the joints that these are.

    Names lose their colons: three.js keeps a colon in a bone's name and drops it from the motion's.
    """
    kept = [bones.hips]
    for j, parent in enumerate(bones.parents):
        if parent in kept:
            kept.append(j)
    return Skeleton(
        names=tuple(bones.names[j].replace(":", "") for j in kept),
        parents=(-1, *(kept.index(bones.parents[j]) for j in kept[1:])),
        positions=bones.positions[kept],
        rotations=bones.rotations[kept],
        hips=0,
    ), kept


def _object_bone(take: Take) -> Skeleton:
    return Skeleton(("object",), (-1,), np.zeros((1, 3)), np.eye(3)[None], hips=0)


def _text(
    bones: Skeleton,
    positions: Float[np.ndarray, "frames joints 3"],
    turns: Float[np.ndarray, "frames joints 3 3"],
    fps: float,
) -> str:
    """A whole file.

    Args:
        bones: the skeleton at rest.
        positions: of its joints.
        turns: of its joints from how they are at rest, in the world.
        fps: frames a second.
    """
    lines = ["HIERARCHY", *_joint(bones, 0, 0), "MOTION", f"Frames: {len(turns)}"]
    lines.append(f"Frame Time: {1.0 / fps:.8f}")
    values = _values(bones, positions, turns)
    lines += [" ".join(f"{x:.{_DIGITS}f}" for x in row) for row in values]
    return "\n".join(lines) + "\n"


def _joint(bones: Skeleton, j: int, depth: int) -> list[str]:
    """A joint and what hangs on it."""
    tab = "\t" * depth
    word = "JOINT" if j else "ROOT"
    travels = "3 " if j else "6 Xposition Yposition Zposition "
    lines = [f"{tab}{word} {bones.names[j]}", f"{tab}{{", f"{tab}\t{_offset(_bone(bones, j))}"]
    lines.append(f"{tab}\tCHANNELS {travels}{_CHANNELS}")
    children = [k for k in _file_order(bones) if bones.parents[k] == j]
    for child in children:
        lines += _joint(bones, child, depth + 1)
    if not children:
        end = f"{tab}\t\t{_offset(_end(bones, j))}"
        lines += [f"{tab}\tEnd Site", f"{tab}\t{{", end, f"{tab}\t}}"]
    return [*lines, f"{tab}}}"]


def _bone(bones: Skeleton, j: int) -> Float[np.ndarray, "3"]:
    """Return the way from the parent to a joint at rest; the first joint's place is in its channels."""
    parent = bones.parents[j]
    return np.zeros(3) if parent < 0 else bones.positions[j] - bones.positions[parent]


def _end(bones: Skeleton, j: int) -> Float[np.ndarray, "3"]:
    """A tip for the last joint of a limb, which has no bone of its own."""
    bone = _bone(bones, j)
    return bone * _END if bone.any() else np.array([0.0, 1.0, 0.0])


def _offset(offset: Float[np.ndarray, "3"]) -> str:
    return "OFFSET " + " ".join(f"{x:.{_DIGITS}f}" for x in offset)


def _file_order(bones: Skeleton) -> Sequence[int]:
    """Joints as the file has them: each followed by all that hangs on it."""
    order: list[int] = []
    waiting = [0]
    while waiting:
        j = waiting.pop()
        order.append(j)
        waiting += [k for k in range(len(bones.names)) if bones.parents[k] == j][::-1]
    return order


def _values(
    bones: Skeleton,
    positions: Float[np.ndarray, "frames joints 3"],
    turns: Float[np.ndarray, "frames joints 3 3"],
) -> Float[np.ndarray, "frames channels"]:
    local = turns[:, bones.above].swapaxes(-1, -2) @ turns
    local[:, 0] = turns[:, 0]
    angles = [_angles(local[:, j]) for j in _file_order(bones)]
    return np.concatenate([positions[:, 0], *angles], axis=1)


def _angles(R: Float[np.ndarray, "frames 3 3"]) -> Float[np.ndarray, "frames 3"]:
    """Degrees about the file's axes, without jumps of whole turns from frame to frame."""
    # At a right angle of the second one the other two are not unique; any of them is right.
    angles = Rotation.from_matrix(R).as_euler(_ORDER, suppress_warnings=True)
    return np.degrees(np.unwrap(angles, axis=0))
