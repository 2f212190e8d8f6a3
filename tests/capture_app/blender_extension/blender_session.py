"""Run by a Python that has Blender's bpy: the extension is installed and used as its menu uses it.

    python blender_session.py WHAT ZIP OMOCAP RESULT FOLDER [RIG ...]

Prints one line of JSON with what was found. WHAT is import, bake, person or fbx.
"""

import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

TURN = Matrix.Rotation(0.7, 4, "Z")
PARTS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "left_toe", "right_toe")


def installed(package: str, omocap: str) -> None:
    """Preferences > Get Extensions > Install from Disk, and the path of omocap."""
    bpy.ops.extensions.package_install_files(
        filepath=package, repo="user_default", enable_on_install=True
    )
    addon = bpy.context.preferences.addons["bl_ext.user_default.omocap"]
    addon.preferences.omocap = omocap


def refused(call: Any, **options: Any) -> str:
    """The text of an error that the user would see; "" if there is none."""
    try:
        call(**options)
    except RuntimeError as error:
        return str(error)
    return ""


def check_import(result: str, folder: Path) -> dict[str, Any]:
    """File > Import > omocap result."""
    nothing = refused(bpy.ops.omocap.import_result, directory=str(folder / "nothing"))
    preferences = bpy.context.preferences.addons["bl_ext.user_default.omocap"].preferences
    program, preferences.omocap = preferences.omocap, "/no/omocap"
    missing = refused(bpy.ops.omocap.import_result, directory=result)
    preferences.omocap = program
    bpy.ops.omocap.import_result(directory=result)
    scene = bpy.context.scene
    armature, thing = found("ARMATURE"), found("MESH", "object")
    rows = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        hips = armature.matrix_world @ armature.pose.bones["pelvis"].head
        contacts = [int(armature[f"{part}_contact"]) for part in PARTS]
        rows.append([*hips, *thing.matrix_world.translation, *contacts])
    drawn(folder / "blender_person.png", scene, thing)
    return {
        "nothing": nothing, "missing": missing, "rows": rows,
        "range": [scene.frame_start, scene.frame_end, scene.render.fps],
        "markers": [[m.name, m.frame] for m in scene.timeline_markers],
        "loose": thing.parent is None and not thing.constraints,
        "panel": [hasattr(bpy.types, n) for n in ("VIEW3D_PT_omocap", "VIEW3D_PT_omocap_bones")],
    }  # fmt: skip


def found(kind: str, name: str = "") -> Any:
    """The imported object of a kind."""
    return next(
        o
        for o in bpy.data.objects
        if o.type == kind and o.name.startswith(name) and "omocap_result" in o
    )


def check_bake(result: str, folder: Path, rigs: list[str]) -> dict[str, Any]:
    """Bake to my armature: characters that stand somewhere, turned, scaled and with a skin."""
    bpy.ops.omocap.import_result(directory=result)
    thing, found_things = found("MESH", "object"), {}
    for file in [*rigs, "metarig"]:
        name = Path(file).stem
        described = (
            None if file == "metarig" else json.loads(Path(file).with_suffix(".json").read_text())
        )
        armature = rig_in_scene(file)
        armature.matrix_world = Matrix.Translation((1.5, -2.0, 0.0)) @ TURN @ armature.matrix_world
        bpy.context.view_layer.update()
        bpy.context.view_layer.objects.active = armature
        before = {o.name for o in bpy.data.objects}
        rest = {
            b.name: np.array(armature.matrix_world @ b.matrix_local) for b in armature.data.bones
        }
        shown = bpy.ops.omocap.guess_bones()
        if described is not None and described["named"]:
            for row in armature.omocap_bones:  # As the user would choose them in the panel.
                row.theirs = described["named"].get(row.ours, "")
        bones = {row.ours: row.theirs for row in armature.omocap_bones if row.theirs}
        bpy.ops.omocap.bake()
        lengths = [b.length for b in armature.data.bones]
        found_things[name] = {
            "helpers": sorted({o.name for o in bpy.data.objects} ^ before),
            "scale": list(armature.matrix_world.to_scale()), "shown": list(shown), "bones": len(bones),
            "action": armature.animation_data.action.name, "bone": max(lengths),
            **baked(armature, thing, bones, rest, described),
        }  # fmt: skip
        if name == "unreal":
            drawn(folder / "blender_character.png", bpy.context.scene, thing)
        for part in [armature, *armature.children]:
            bpy.data.objects.remove(part)
    return found_things


def rig_in_scene(file: str) -> Any:
    """A character as the user has it: Rigify's metarig, or a file that was imported."""
    if file == "metarig":
        bpy.ops.preferences.addon_enable(module="rigify")
        bpy.ops.object.armature_human_metarig_add()
        return bpy.context.object
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=file, disable_bone_shape=True)
    return next(o for o in bpy.data.objects if o not in before and o.type == "ARMATURE")


def baked(armature: Any, thing: Any, bones: Any, rest: Any, described: Any) -> dict[str, float]:
    """How far palms are from their points, soles from the floor, and how far they slide, mm."""
    scene, place = bpy.context.scene, armature.matrix_world
    spans = [span.to_dict() for span in thing["contacts"]]
    points = follow_points(armature, bones, rest, described)
    rows: dict[str, list[Any]] = {part: [] for part in PARTS}
    poses = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        poses.append(np.array(thing.matrix_world))
        for part, (bone, local) in points.items():
            rows[part].append(np.array(place @ armature.pose.bones[bone].matrix @ Vector(local)))
    palm, sole, slide = 0.0, 0.0, 0.0
    for span in spans:
        part, frames = span["part"], slice(round(span["from"] * 30), round(span["to"] * 30))
        at = np.array(rows[part][frames])
        if part.endswith("hand"):
            wanted = (np.array(poses[frames]) @ [*span["point"], 1.0])[:, :3]
            palm = max(palm, float(np.linalg.norm(at - wanted, axis=1).max()))
        else:
            sole = max(sole, float(np.abs(at[:, 2]).max()))
            slide = max(slide, float(np.linalg.norm(np.diff(at[:, :2], axis=0), axis=1).max()))
    return {"palm": 1000 * palm, "sole": 1000 * sole, "slide": 1000 * slide}


def follow_points(armature: Any, bones: Any, rest: Any, described: Any) -> dict[str, Any]:
    """The bone that carries each part, and the point of the part in the bone's own axes."""
    points = {}
    for side in ("left", "right"):
        for part, joint in (("ankle", "ankle"), ("toe", "foot"), ("hand", "wrist")):
            bone = bones[f"{side}_{joint}"]
            at = rest[bone][:3, 3].copy()
            if part == "hand":
                at = rest[bones.get(f"{side}_middle1", bone)][:3, 3]
                if described is not None:
                    # From wrist to palm, as the character was made: it may have no fingers.
                    x, y, z = described[side]
                    at = rest[bone][:3, 3] + np.array(TURN.to_3x3()) @ [x, -z, y]
            else:
                at[2] = armature.matrix_world.translation.z
            points[f"{side}_{part}"] = bone, (np.linalg.inv(rest[bone]) @ [*at, 1.0])[:3]
    return points


def check_person(folder: Path) -> dict[str, Any]:
    """Make the person: a box that is keyed at 24 frames a second, beginning at frame 11."""
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = 24, 11, 107
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.name, box.dimensions = "Crate", (0.3, 0.5, 0.3)
    for frame, (x, z) in {
        11: (0, 0.15),
        35: (0, 0.15),
        53: (0.1, 0.9),
        77: (0.8, 0.9),
        95: (0.9, 0.15),
        107: (0.9, 0.15),
    }.items():
        box.location = x, 0.2, z
        box.keyframe_insert("location", frame=frame)
    scene.omocap.options = "--samples 1"
    bpy.ops.omocap.make_person(output=str(folder / "crate_motion"))
    armature = found("ARMATURE")
    palms = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        for side in ("left", "right"):
            if armature[f"{side}_hand_contact"]:
                palm = armature.matrix_world @ armature.pose.bones[f"{side}_middle1"].head
                palms.append([side == "right", *(box.matrix_world.inverted() @ palm)])
    return {
        "palms": palms, "range": [scene.frame_start, scene.frame_end, scene.render.fps],
        "things": sorted(o.name for o in bpy.data.objects if "omocap_result" in o),
        "result": scene.omocap.result,
    }  # fmt: skip


def check_fbx(rigs: list[str]) -> dict[str, Any]:
    """Characters as FBX, as Blender writes them, with leaf bones."""
    for file in rigs:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_scene.gltf(filepath=file, bone_heuristic="BLENDER")
        target = str(Path(file).with_suffix(".fbx"))
        bpy.ops.export_scene.fbx(filepath=target, add_leaf_bones=True)
    return {}


def drawn(path: Path, scene: Any, thing: Any) -> None:
    """A still of a frame in which the object is carried."""
    scene.frame_set(scene.frame_start + 120)
    for extra in ("Cube", "Light", "Camera"):
        if extra in bpy.data.objects:
            bpy.data.objects.remove(bpy.data.objects[extra])
    bpy.ops.mesh.primitive_plane_add(size=30)
    plane = bpy.context.object
    world = bpy.data.worlds.new("sky")
    world.color = (0.4, 0.45, 0.5)
    scene.world = world
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.3, 0.4))
    sun = bpy.context.object
    sun.data.energy = 3.0
    target = thing.matrix_world.translation * 1.0
    target.z = 0.85
    eye = target + Vector((4.6, -1.0, 0.6))
    bpy.ops.object.camera_add(
        location=eye, rotation=(target - eye).to_track_quat("-Z", "Y").to_euler()
    )
    scene.camera = bpy.context.object
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 16, False
    scene.render.resolution_x, scene.render.resolution_y = 640, 360
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    for part in (plane, sun, scene.camera):
        bpy.data.objects.remove(part)


def main(what: str, package: str, omocap: str, result: str, folder: str, *rigs: str) -> None:
    """Install, and do one thing."""
    installed(package, omocap)
    done = {
        "import": lambda: check_import(result, Path(folder)),
        "bake": lambda: check_bake(result, Path(folder), list(rigs)),
        "fbx": lambda: check_fbx(list(rigs)),
        "person": lambda: check_person(Path(folder)),
    }[what]()
    print(json.dumps(done))


if __name__ == "__main__":
    main(*sys.argv[1:])
