"""Run by Blender's own Python, not by ours: a GLB of `omocap export` becomes FBX, a character's FBX a GLB.

    blender --background --python in_blender.py -- take.glb take.fbx 30 y cm
    blender --background --python in_blender.py -- character.fbx character.glb

Arguments: the two files; of a take also frames a second, up axis (y or z), unit of the FBX (m or cm).
"""

import sys
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

_SCALE_LENGTH = {"m": 1.0, "cm": 0.01}
_FORWARD = {"y": "-Z", "z": "-Y"}
_FBX_SCALE = {"m": "FBX_SCALE_UNITS", "cm": "FBX_SCALE_NONE"}
"""Either leaves every object at scale 1: the unit is the file's."""


def convert(source: str, target: str, fps: float, up: str, units: str) -> None:
    """Read the GLB into an empty scene of its rate and unit, and write the FBX."""
    bpy: Any = import_module("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = round(fps)
    scene.render.fps_base = round(fps) / fps
    scene.unit_settings.scale_length = _SCALE_LENGTH[units]
    # It comes in the scene's unit; without the ball that shows a bone, which would be written too.
    bpy.ops.import_scene.gltf(filepath=source, disable_bone_shape=True)
    scene.frame_start, scene.frame_end = 0, _last_frame(bpy)
    for thing in bpy.data.objects:
        if thing.type == "ARMATURE":
            # Unreal takes a node of this name for Blender's, and makes no bone of it.
            thing.name = "Armature"
        elif not any(modifier.type == "ARMATURE" for modifier in thing.modifiers):
            # Only what hangs on no armature keeps its own animation.
            thing.parent = None
    with TemporaryDirectory() as folder:
        _write_pictures(bpy, Path(folder))
        _write_fbx(bpy, target, up, units)


def _write_pictures(bpy: Any, folder: Path) -> None:
    """Save the pictures that are packed in the GLB: the FBX exporter embeds files only."""
    for number, image in enumerate(bpy.data.images):
        if image.packed_file is not None:
            image.filepath_raw = str(folder / f"object_{number}.png")
            image.file_format = "PNG"
            image.save()


def _write_fbx(bpy: Any, target: str, up: str, units: str) -> None:
    bpy.ops.export_scene.fbx(
        filepath=target,
        path_mode="COPY",
        embed_textures=True,
        object_types={"ARMATURE", "MESH", "EMPTY"},
        axis_up=up.upper(),
        axis_forward=_FORWARD[up],
        apply_scale_options=_FBX_SCALE[units],
        add_leaf_bones=False,
        bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False,
        bake_anim_simplify_factor=0.0,
    )


def read_character(source: str, target: str) -> None:
    """Read a character's FBX into an empty scene, and write it at rest as GLB."""
    bpy: Any = import_module("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.fbx(filepath=source, use_anim=False)
    bpy.ops.export_scene.gltf(
        filepath=target,
        export_animations=False,
        export_morph=False,
        export_materials="NONE",
        export_rest_position_armature=True,
    )


def _last_frame(bpy: Any) -> int:
    return max(round(action.frame_range[1]) for action in bpy.data.actions)


if __name__ == "__main__":
    given = sys.argv[sys.argv.index("--") + 1 :]
    if len(given) == 2:
        read_character(given[0], given[1])
    else:
        convert(given[0], given[1], float(given[2]), given[3], given[4])
