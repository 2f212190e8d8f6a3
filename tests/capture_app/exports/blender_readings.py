"""What Blender makes of the exports in a folder, as a line of JSON; runs in a Python that has bpy."""

import json
import struct
import sys
from pathlib import Path

import bpy

folder = sys.argv[-1]
READERS = {
    "glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    "usdc": lambda path: bpy.ops.wm.usd_import(filepath=path),
    "fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path),
    "bvh": lambda path: bpy.ops.import_anim.bvh(filepath=path),
}
found = {}
for ending, read in READERS.items():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = 24
    read(f"{folder}/take.{ending}")
    found[ending] = {
        "fps": scene.render.fps,
        "starts": sorted({float(action.frame_range[0]) for action in bpy.data.actions}),
        "constraints": [c.type for one in scene.objects for c in one.constraints],
        "keyed": [one.name for one in scene.objects if one.animation_data],
        "credits": [one["credit"] for one in scene.objects if "credit" in one],
    }
    if ending == "glb":
        bpy.ops.export_scene.gltf(filepath=f"{folder}/again.glb", export_extras=True)
        whole = Path(folder, "again.glb").read_bytes()
        again = json.loads(whole[20 : 20 + struct.unpack_from("<I", whole, 12)[0]])
        credits = [
            node["extras"]["credit"]
            for node in again["nodes"]
            if "credit" in node.get("extras", {})
        ]
        found["again"] = {"asset": again["asset"], "credits": credits}
print(json.dumps(found))
