"""A motion on the user's own armature: its rig goes to omocap, and the poses of the answer are keyed on it.

Where its bones shall be in the world comes from the answer, frame by frame; here they are only said in the
terms of the user's armature, wherever that stands and however it is scaled.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .bone_names import NAMED_AS, NEEDED, recognised
from .motion_in_scene import ImportedMotion, bpy, key_all, new_action
from .omocap_job import ExtensionFailure

mathutils: Any = import_module("mathutils")

_OFF = 1e-3
"""Metres by which a bone may be elsewhere without a note."""
_CHECKED = 10
"""Frames from one check of the bones' places to the next."""


def guessed_bones(armature: Any) -> dict[str, str]:
    """Our joint -> the armature's bone that has its name in the table that fits best."""
    names = [bone.name for bone in armature.data.bones]
    return {ours: names[k] for ours, k in recognised(names).items()}


def export_rig(armature: Any, bones: Mapping[str, str], path: Path) -> dict[str, str]:
    """Write the armature at rest with its skin, over the origin, under our names of the bones.

    Args:
        armature: how it is turned and scaled counts, and where it stands does not.
        bones: our joint -> its bone.
        path: the GLB to write.

    Returns:
        The file's names of the bones -> those of the armature.

    Raises:
        ExtensionFailure: bones are missing.
    """
    own = {bone.name for bone in armature.data.bones}
    missing = [ours for ours in NEEDED if bones.get(ours) not in own]
    if missing:
        raise ExtensionFailure(
            f"{armature.name} lacks a bone for {', '.join(missing[:4])}"
            + (f" and {len(missing) - 4} more" if len(missing) > 4 else "")
            + f". Name its bones as {NAMED_AS} names them, or choose them in the panel under Bones."
        )
    named = {theirs: ours for ours, theirs in bones.items() if theirs in own}
    others = (bone.name for bone in armature.data.bones if bone.name not in named)
    named |= {theirs: f"other_{k}" for k, theirs in enumerate(others)}
    helpers = _renamed_copies(armature, named)
    try:
        bpy.ops.object.select_all(action="DESELECT")
        for part in helpers:
            part.select_set(True)
        bpy.ops.export_scene.gltf(
            filepath=str(path), use_selection=True, export_animations=False, export_morph=False,
            export_materials="NONE", export_rest_position_armature=True, export_yup=True,
        )  # fmt: skip
    finally:
        for part in helpers:
            data = part.data
            bpy.data.objects.remove(part)
            bpy.data.batch_remove([data])
    return {ours: theirs for theirs, ours in named.items()}


def _renamed_copies(armature: Any, named: Mapping[str, str]) -> list[Any]:
    """Copies of the armature and of the meshes on it, with other names of bones."""
    scene = bpy.context.scene
    helper = bpy.data.objects.new("omocap_rig", armature.data.copy())
    for k, bone in enumerate(helper.data.bones):
        bone.name = f"unnamed_{k}"  # No name is taken when the others are given.
    for bone, old in zip(helper.data.bones, armature.data.bones, strict=True):
        bone.name = named[old.name]
    place = armature.matrix_world.copy()
    away = mathutils.Matrix.Translation(-place.translation)
    helpers = [helper]
    helper.matrix_world = away @ place
    for part in scene.objects:
        tied = part.type == "MESH" and any(
            m.type == "ARMATURE" and m.object is armature for m in part.modifiers
        )
        if not tied:
            continue
        copy = bpy.data.objects.new("omocap_skin", part.data.copy())
        copy.parent = helper  # As the exporter wants it.
        copy.matrix_world = away @ part.matrix_world
        for group in part.vertex_groups:
            # The weights lie in the mesh, by index.
            copy.vertex_groups.new(name=named.get(group.name, group.name))
        copy.modifiers.new("rig", "ARMATURE").object = helper
        helpers.append(copy)
    for part in helpers:
        scene.collection.objects.link(part)
    return helpers


@dataclass
class _Bone:
    """A bone of the user's armature, and who says where it shall be."""

    own: Any
    """The Bone, at rest."""
    source: Any
    """The answer's PoseBone; None for a bone that goes along with its parent."""
    places: np.ndarray
    turns: np.ndarray
    """The pose bone in its own terms: (frames, 3), and w, x, y, z (frames, 4)."""


def bake(armature: Any, answer: ImportedMotion, names: Mapping[str, str], name: str) -> list[str]:
    """Key the answer's motion on the user's armature, as a new action.

    Args:
        armature: that of `export_rig`.
        answer: omocap's answer to that rig.
        names: from `export_rig`.
        name: of the action.

    Returns:
        The bones that are not where the motion wants them, for constraints hold them or a driver does.

    Raises:
        ExtensionFailure: the armature is mirrored, stretched, or no person's size.
    """
    bones = _paired(armature, answer, names)
    curves = new_action(armature, name)
    bpy.context.view_layer.update()
    _check_size(armature, answer.armature, bones)
    for bone in bones:
        pose = armature.pose.bones[bone.own.name]
        pose.rotation_mode, pose.matrix_basis = "QUATERNION", mathutils.Matrix()
    for k in range(answer.frames):
        bpy.context.scene.frame_set(answer.first + k)
        _read_frame(k, armature, answer, bones)
    for bone in bones:
        path = f'pose.bones["{bpy.utils.escape_identifier(bone.own.name)}"]'
        key_all(curves, f"{path}.rotation_quaternion", answer.first, _continuous(bone.turns))
        if bone.own.parent is None or np.abs(bone.places).max() > 1e-5:
            key_all(curves, f"{path}.location", answer.first, bone.places)
    return _elsewhere(armature, answer, bones)


def _paired(armature: Any, answer: ImportedMotion, names: Mapping[str, str]) -> list[_Bone]:
    """The bones that are to be keyed, parents first: the answer's, and those above them."""
    theirs = {own: answer.armature.pose.bones.get(file) for file, own in names.items()}
    keyed = {own for own, source in theirs.items() if source is not None}
    keyed |= {p.name for own in keyed for p in armature.data.bones[own].parent_recursive}
    own = sorted(
        (armature.data.bones[name] for name in keyed), key=lambda b: len(b.parent_recursive)
    )
    frames = answer.frames
    return [_Bone(b, theirs.get(b.name), np.zeros((frames, 3)), np.zeros((frames, 4))) for b in own]


def _check_size(armature: Any, answered: Any, bones: list[_Bone]) -> None:
    scale = np.array(armature.matrix_world.to_scale())
    if armature.matrix_world.is_negative or np.ptp(scale) > 1e-3 * scale.max():
        raise ExtensionFailure(
            f"{armature.name} is stretched or mirrored: apply its scale (Ctrl A)."
        )
    known = [bone for bone in bones if bone.source is not None]
    own = np.ptp([scale[0] * np.array(b.own.head_local) for b in known], axis=0)
    metres = answered.matrix_world.to_scale()[0]
    wanted = np.ptp([metres * np.array(b.source.bone.head_local) for b in known], axis=0)
    ratio = float(np.linalg.norm(own) / np.linalg.norm(wanted))
    if abs(ratio - 1.0) > 0.01:
        raise ExtensionFailure(
            f"{armature.name} is {ratio:.3g} times as large as a person in metres: scale the object by "
            f"{1 / ratio:.3g}."
        )


def _read_frame(k: int, armature: Any, answer: ImportedMotion, bones: list[_Bone]) -> None:
    """Take over the frame that the scene shows."""
    to_own = armature.matrix_world.inverted()
    turn = to_own.to_quaternion()
    poses: dict[str, Any] = {}
    for bone in bones:
        own, above = bone.own, bone.own.parent
        if bone.source is not None:
            world = answer.armature.matrix_world @ bone.source.matrix
            pose = mathutils.Matrix.LocRotScale(
                to_own @ world.translation, turn @ world.to_quaternion(), None
            )
        elif above is None:
            pose = own.matrix_local.copy()
        else:
            pose = poses[above.name] @ above.matrix_local.inverted() @ own.matrix_local
        poses[own.name] = pose
        parents = {} if above is None else {
            "parent_matrix": poses[above.name], "parent_matrix_local": above.matrix_local,
        }  # fmt: skip
        basis = own.convert_local_to_pose(pose, own.matrix_local, invert=True, **parents)
        bone.places[k], bone.turns[k] = basis.to_translation(), basis.to_quaternion()


def _continuous(turns: np.ndarray) -> np.ndarray:
    """The same rotations, never jumping between q and -q."""
    jumps = np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return turns * np.concatenate([[1.0], np.cumprod(jumps)])[:, None]


def _elsewhere(armature: Any, answer: ImportedMotion, bones: list[_Bone]) -> list[str]:
    off: set[str] = set()
    for k in range(0, answer.frames, _CHECKED):
        bpy.context.scene.frame_set(answer.first + k)
        for bone in (b for b in bones if b.source is not None):
            at = armature.matrix_world @ armature.pose.bones[bone.own.name].head
            wanted = answer.armature.matrix_world @ bone.source.head
            if (at - wanted).length > _OFF:
                off.add(bone.own.name)
    return sorted(off)
