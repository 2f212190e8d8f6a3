"""Export one animated object from Blender as a GLB for `omocap run`.

From a shell:

    blender scene.blend --background --python blender_export.py -- --object Chair --out chair.glb

From Blender's Text Editor: select the object, run the script; it writes NAME.glb beside the .blend.

Every frame of the scene is sampled as Blender shows it, so parents, constraints, drivers and physics
count; modifiers are applied to the mesh. Meshes parented to the object belong to it, as they are in
the first frame. Runs in Blender's own Python, which has numpy.
"""

import argparse
import json
import struct
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

_FLOAT, _UINT = 5126, 5125
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_C = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""From Blender's axes (z up) to those of glTF (y up)."""
_CHANGED = 1e-3


def main(arguments: list[str]) -> None:
    """Export what the arguments say from the scene that is open."""
    bpy: Any = import_module("bpy")
    parser = argparse.ArgumentParser(prog="blender_export.py", description=__doc__)
    parser.add_argument("--object", help="its name; the active object if not given")
    parser.add_argument("--out", type=Path, help="GLB to write; beside the .blend if not given")
    parser.add_argument("--start", type=int, help="first frame; the scene's if not given")
    parser.add_argument("--end", type=int, help="last frame; the scene's if not given")
    given = parser.parse_args(arguments)
    scene = bpy.context.scene
    thing = bpy.data.objects.get(given.object) if given.object else bpy.context.object
    if thing is None:
        names = ", ".join(o.name for o in scene.objects)
        raise SystemExit(f"There is no object {given.object!r} here. There are: {names}")
    start = scene.frame_start if given.start is None else given.start
    end = scene.frame_end if given.end is None else given.end
    out = given.out or Path(bpy.path.abspath("//")) / f"{thing.name}.glb"
    matrices, vertices, triangles = sample(bpy, thing, range(start, end + 1))
    fps = scene.render.fps / scene.render.fps_base
    metres = scene.unit_settings.scale_length
    out.write_bytes(glb(thing.name, matrices, vertices, triangles, fps, metres))
    print(f"Wrote {len(matrices)} frames at {fps:g} fps of {thing.name} to {out}")


def sample(bpy: Any, thing: Any, frames: range) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """World matrix in each frame; vertices in the object's axes and triangles in the first."""
    scene, before = bpy.context.scene, bpy.context.scene.frame_current
    matrices = []
    try:
        scene.frame_set(frames[0])
        vertices, triangles = surface(bpy, thing)
        for frame in frames:
            scene.frame_set(frame)
            evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
            matrices.append(np.array(evaluated.matrix_world, dtype=float))
    finally:
        scene.frame_set(before)
    return np.array(matrices), vertices, triangles


def surface(bpy: Any, thing: Any) -> tuple[np.ndarray, np.ndarray]:
    """What the object and the meshes below it look like now, modifiers applied."""
    graph = bpy.context.evaluated_depsgraph_get()
    to_thing = np.linalg.inv(np.array(thing.evaluated_get(graph).matrix_world, dtype=float))
    parts, faces, count = [], [], 0
    for part in (thing, *thing.children_recursive):
        evaluated = part.evaluated_get(graph)
        mesh = evaluated.to_mesh() if part.type in ("MESH", "CURVE", "SURFACE", "FONT") else None
        if mesh is None:
            continue
        mesh.calc_loop_triangles()
        points = np.empty(len(mesh.vertices) * 3, np.float32)
        mesh.vertices.foreach_get("co", points)
        corners = np.empty(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        to_here = to_thing @ np.array(evaluated.matrix_world, dtype=float)
        parts.append(points.reshape(-1, 3) @ to_here[:3, :3].T + to_here[:3, 3])
        faces.append(corners.reshape(-1, 3) + count)
        count += len(mesh.vertices)
        evaluated.to_mesh_clear()
    if not count:
        raise SystemExit(f"{thing.name} has no surface; choose the object that carries the mesh.")
    return np.concatenate(parts), np.concatenate(faces)


def glb(
    name: str,
    matrices: np.ndarray,
    vertices: np.ndarray,
    triangles: np.ndarray,
    fps: float,
    metres: float = 1.0,
) -> bytes:
    """A GLB with one animated node that carries the mesh.

    Args:
        name: of the node.
        matrices: (frames, 4, 4) from the object's axes into Blender's world.
        vertices: (verts, 3) in the object's axes.
        triangles: (faces, 3) indices.
        fps: frames a second.
        metres: in one unit of Blender.
    """
    poses, stretch = without_stretch(matrices)
    if np.linalg.det(stretch) < 0:
        triangles = triangles[:, ::-1]
    poses[:, :3, 3] *= metres
    points = vertices @ stretch.T @ _C[:3, :3].T * metres
    poses = _C @ poses @ _C.T
    arrays = [
        points,
        triangles.reshape(-1, 1),
        np.arange(len(poses))[:, None] / fps,
        poses[:, :3, 3],
        quaternions(poses[:, :3, :3]),
    ]
    accessors, views, data = _packed(arrays)
    sampler = {"input": 2, "interpolation": "LINEAR"}
    scene = {
        "asset": {"version": "2.0", "generator": "omocap blender_export.py"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0}],
        "meshes": [
            {"name": name, "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}
        ],
        "animations": [
            {
                "name": name,
                "samplers": [{**sampler, "output": 3}, {**sampler, "output": 4}],
                "channels": [
                    {"sampler": 0, "target": {"node": 0, "path": "translation"}},
                    {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
                ],
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def without_stretch(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rigid poses, and the scale (even or not) that the mesh has in every frame."""
    _, sizes, axes = np.linalg.svd(matrices[0, :3, :3])
    stretch = (axes.T * sizes) @ axes * np.sign(np.linalg.det(matrices[0, :3, :3]))
    if sizes.min() < 1e-6:
        raise SystemExit("The object is scaled to nothing.")
    poses = matrices.copy()
    poses[:, :3, :3] = matrices[:, :3, :3] @ np.linalg.inv(stretch)
    off = np.abs(poses[:, :3, :3].swapaxes(1, 2) @ poses[:, :3, :3] - np.eye(3)).max(axis=(1, 2))
    if off.max() > _CHANGED:
        raise SystemExit(
            f"The object changes its size or shape in sampled frame {np.argmax(off > _CHANGED)}; "
            "people move rigid things. Take out keys of scale, and apply the scale of its parents."
        )
    return poses, stretch


def quaternions(R: np.ndarray) -> np.ndarray:
    """x, y, z, w of rotation matrices, never jumping between q and -q (Bar-Itzhack 2000)."""
    K = np.zeros((len(R), 4, 4))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        K[:, i, i] = R[:, i, i] - R[:, j, j] - R[:, k, k]
        K[:, i, j] = K[:, j, i] = R[:, i, j] + R[:, j, i]
        K[:, i, 3] = K[:, 3, i] = R[:, k, j] - R[:, j, k]
    K[:, 3, 3] = np.trace(R, axis1=1, axis2=2)
    q = np.linalg.eigh(K)[1][:, :, -1]
    turned = np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(turned)])[:, None]


def _packed(arrays: list[np.ndarray]) -> tuple[list[dict[str, Any]], list[dict[str, Any]], bytes]:
    """Accessors, buffer views and bytes of arrays with one value a row."""
    accessors, views, data = [], [], b""
    for array in arrays:
        whole = array.dtype.kind in "iu"
        values = array.astype("<u4" if whole else "<f4")
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": _UINT if whole else _FLOAT,
                "count": len(values),
                "type": _TYPES[values.shape[1]],
                "min": values.min(axis=0).tolist(),
                "max": values.max(axis=0).tolist(),
            }
        )
        data += values.tobytes()
    return accessors, views, data


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
