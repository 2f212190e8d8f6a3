"""Do exports arrive in Blender as they left? Run by a Python that has Blender's `bpy`, see the .sh file.

    python check_in_blender.py FOLDER

FOLDER holds one take as take.npz (--to amass: the truth) and any of take.glb, take.bvh with
take_object.bvh, take.usdc, take.fbx. Each is imported into an empty scene as a user would; in some frames
every joint and the object's pose are compared with the arrays, and a still is drawn beside the file.
Exits with 1 if a joint is farther than 0.1 mm from its place, or something is missing.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion, Vector

TOLERANCE = 1e-4
"""Metres."""
LOOKED_AT = 12
"""Frames of each take."""
SIZE = (640, 360)
SAMPLES = 12


class ExportedArrays:
    """What the arrays say: world z up, metres."""

    def __init__(self, path: Path) -> None:
        with np.load(path, allow_pickle=False) as file:
            self.fps = float(file["mocap_frame_rate"])
            self.names = [str(name) for name in file["joint_names"]]
            self.joints = file["joints"]
            self.place = file["object_position"]
            self.turn = [rotation(q) for q in file["object_rotation_xyzw"]]
            self.vertices = file["object_vertices"]

    def surface(self, frame: int) -> np.ndarray:
        """The object's vertices in the world."""
        return self.vertices @ self.turn[frame].T + self.place[frame]


def rotation(xyzw: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion."""
    x, y, z, w = (float(v) for v in xyzw)
    return np.array(Quaternion((w, x, y, z)).to_matrix())


def import_glb(path: Path) -> int:
    """File > Import > glTF 2.0."""
    bpy.ops.import_scene.gltf(filepath=str(path))
    return 0


def import_bvh(path: Path) -> int:
    """File > Import > Motion Capture (.bvh), Scale 0.01."""
    for file in (path, path.with_name(f"{path.stem}_object.bvh")):
        bpy.ops.import_anim.bvh(
            filepath=str(file), global_scale=0.01, frame_start=1, update_scene_fps=True
        )
    return 1


def import_usd(path: Path) -> int:
    """File > Import > Universal Scene Description."""
    bpy.ops.wm.usd_import(filepath=str(path))
    return 0


def import_fbx(path: Path) -> int:
    """File > Import > FBX (legacy)."""
    bpy.ops.import_scene.fbx(filepath=str(path), automatic_bone_orientation=False)
    return 1


IMPORTS: dict[str, Callable[[Path], int]] = {
    "take.glb": import_glb,
    "take.bvh": import_bvh,
    "take.usdc": import_usd,
    "take.fbx": import_fbx,
}
"""How a user imports each, and the frame in which its motion then begins."""


def main(folder: Path) -> int:
    """Check every file of the folder."""
    truth, bad = ExportedArrays(folder / "take.npz"), 0
    for name, importer in IMPORTS.items():
        if not (folder / name).exists():
            continue
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.render.fps = round(truth.fps)
        first = importer(folder / name)
        try:
            joints, thing = compare(truth, first)
        except LookupError as missing:
            print(f"{name}: MISSING {missing}")
            bad += 1
            continue
        pictures, empty = base_pictures(), empty_pictures()
        fine = max(joints, thing) <= TOLERANCE and not empty
        bad += not fine
        print(
            f"{name}: joints within {1000 * joints:.4f} mm, object within {1000 * thing:.4f} mm, "
            f"pictures {', '.join(pictures) or 'none'}: {'ok' if fine else 'WRONG'}",
            *(f"(the picture {missing} did not arrive)" for missing in empty),
            flush=True,
        )
        draw(folder / f"blender_{name.rsplit('.', 1)[1]}.png", truth, first)
    return 1 if bad else 0


def compare(truth: ExportedArrays, first: int) -> tuple[float, float]:
    """Largest distance of a joint and of a point of the object from where they should be, metres."""
    figure, thing = find(truth)
    joints, surface = 0.0, 0.0
    start = None
    for frame in np.linspace(0, len(truth.joints) - 1, LOOKED_AT).round().astype(int):
        bpy.context.scene.frame_set(int(frame) + first)
        bpy.context.view_layer.update()
        places = [bone_place(figure, name) for name in truth.names]
        joints = max(joints, distance(np.array(places), truth.joints[frame]))
        if thing.type == "MESH":
            surface = max(surface, nearest(truth.surface(frame), mesh_points(thing)))
            continue
        place, turn = bone_pose(thing)
        start = start or (turn, truth.turn[frame])
        # A bone's own axes are Blender's choice: how it has turned since the start is not.
        moved, wanted = turn @ start[0].T, truth.turn[frame] @ start[1].T
        surface = max(surface, distance(place[None], truth.place[frame][None]))
        surface = max(surface, float(np.abs(moved - wanted).max()))
    return joints, surface


def base_pictures() -> list[str]:
    """Sizes of the pictures that materials use."""
    nodes = [n for m in bpy.data.materials if m.node_tree for n in m.node_tree.nodes]
    images = {n.image for n in nodes if n.type == "TEX_IMAGE" and n.image is not None}
    return sorted(f"{image.size[0]} x {image.size[1]}" for image in images)


def empty_pictures() -> list[str]:
    """Names of pictures that Blender could not read."""
    return sorted(i.name for i in bpy.data.images if i.source == "FILE" and not i.size[0])


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance between points and their partners."""
    return float(np.linalg.norm(a - b, axis=1).max())


def nearest(points: np.ndarray, cloud: np.ndarray) -> float:
    """Largest distance of a point to the cloud: importers may split and reorder vertices."""
    return max(float(np.linalg.norm(cloud - p, axis=1).min()) for p in points)


def bone_place(figure, name: str) -> np.ndarray:
    """Where a bone begins, world."""
    bone = figure.pose.bones.get(name)
    if bone is None:
        raise LookupError(f"bone {name}")
    return np.array(figure.matrix_world @ bone.head)


def bone_pose(figure) -> tuple[np.ndarray, np.ndarray]:
    """Place and rotation matrix of the object's one bone in the world."""
    bone = figure.pose.bones["object"]
    turn = (figure.matrix_world @ bone.matrix).to_3x3().normalized()
    return np.array(figure.matrix_world @ bone.head), np.array(turn)


def mesh_points(thing) -> np.ndarray:
    """Its vertices in the world."""
    return np.array([thing.matrix_world @ v.co for v in thing.data.vertices])


def find(truth: ExportedArrays):
    """The armature of the person, and what carries the object's motion."""
    armatures = [o for o in bpy.data.objects if o.type == "ARMATURE"]
    figures = [a for a in armatures if truth.names[0] in a.pose.bones]
    things = [o for o in bpy.data.objects if o.type == "MESH" and o.name == "object"]
    things += [a for a in armatures if "object" in a.pose.bones]
    if not figures:
        raise LookupError("the person's armature")
    if not things:
        raise LookupError("the object")
    return figures[0], things[0]


def draw(path: Path, truth: ExportedArrays, first: int) -> None:
    """A still of the middle of the take; bones are drawn as sticks where there is no skin."""
    scene = bpy.context.scene
    frame = len(truth.joints) // 2
    scene.frame_set(frame + first)
    bpy.context.view_layer.update()
    if not any(o.type == "MESH" for o in bpy.data.objects):
        sticks([a for a in bpy.data.objects if a.type == "ARMATURE"])
    stage(truth.joints[frame, 0], truth.place[frame])
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def sticks(armatures) -> None:
    """A cone for every bone."""
    for armature in armatures:
        for bone in armature.pose.bones:
            low, high = (armature.matrix_world @ p for p in (bone.head, bone.tail))
            bpy.ops.mesh.primitive_cone_add(
                vertices=8, radius1=0.03, radius2=0.008, depth=(high - low).length
            )
            cone = bpy.context.object
            cone.location = (low + high) / 2
            cone.rotation_euler = (high - low).to_track_quat("Z", "Y").to_euler()


def stage(person: np.ndarray, thing: np.ndarray) -> None:
    """A floor, a sun, and a camera that sees both from the side of the object."""
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.3, 0.4))
    bpy.context.object.data.energy = 3.0
    way = (thing - person) * [1.0, 1.0, 0.0]
    ahead = Vector(way / max(float(np.linalg.norm(way)), 1e-6))
    ahead.rotate(Quaternion((0.0, 0.0, 1.0), 0.9))
    target = Vector((person[0], person[1], 0.85))
    eye = target + 4.4 * ahead + Vector((0.0, 0.0, 0.6))
    bpy.ops.object.camera_add(location=eye)
    camera = bpy.context.object
    camera.rotation_euler = (target - eye).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = camera
    world = bpy.data.worlds.new("sky")
    world.color = (0.4, 0.45, 0.5)
    bpy.context.scene.world = world


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[-1])))
