"""Files of a robot's motion: a table of its joints, the arrays of retargeting tools, a MuJoCo scene.

Quaternions in them are w first, as in MuJoCo, but for the table: its readers expect w last, as the robot
versions of LAFAN1 have it.
"""

import csv
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_app.robots.robot_model import Robot, robot_package, robot_spec, unreadable
from capture_app.robots.robot_solver import RobotMotion
from omomo_core.geometry.rotations import xyzw_from_matrix
from omomo_core.motion import ObjectMesh, ObjectMotion

TABLE, HEADER, ARRAYS, SCENE = "qpos.csv", "qpos.json", "qpos_with_object.npz", "scene"
_W_FIRST, _W_LAST = [3, 0, 1, 2], [1, 2, 3, 0]


@dataclass(frozen=True)
class SceneSettings:
    """Numbers of the object in a scene."""

    density: float = 200.0
    """Density of the object, kilograms a cubic metre; furniture and boxes are light for their size."""
    concavity: float = 0.08
    """Concavity that coacd leaves in a convex part."""
    parts: int = 32
    """The most convex parts."""


def write_robot_files(
    folder: Path, motion: RobotMotion, moved: ObjectMotion, scene: Any
) -> tuple[Path, ...]:
    """Write all files of a robot's motion into a folder, and return their paths.

    Args:
        folder: exists, and holds nothing but what `scene_of` made in it.
        motion: at the rate of the files.
        moved: the object, as many frames.
        scene: from `scene_of`; gets the key "start", which holds the first frame.
    """
    table, header, arrays = (folder / name for name in (TABLE, HEADER, ARRAYS))
    write_joint_table(table, header, motion)
    qpos = with_object(motion, moved)
    with arrays.open("wb") as file:
        np.savez_compressed(
            file,
            allow_pickle=False,
            fps=np.array(motion.targets.fps),
            qpos=qpos,
            joint_names=np.array(motion.robot.joints),
            object_name=np.array(moved.mesh.name),
            hand_contact=motion.targets.held,
            foot_contact=motion.targets.planted,
        )
    scene.add_key(name="start", qpos=qpos[0])
    # A model is complete only once it has been compiled.
    scene.compile()
    file = folder / SCENE / "scene.xml"
    file.write_text(scene.to_xml(), encoding="utf-8")
    return table, header, arrays, file


def write_joint_table(table: Path, header: Path, motion: RobotMotion) -> None:
    """Write the joints of every frame as CSV without a head, and the file that says what its columns are.

    Args:
        table: .csv; root x, y, z, quaternion (w last), joints in the model's order.
        header: .json; `fps`, `columns` and `units`, one for each column.
        motion: of the robot.
    """
    joints = motion.robot.joints
    rows = np.hstack([motion.qpos[:, :3], motion.qpos[:, 3:7][:, _W_LAST], motion.qpos[:, 7:]])
    with table.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([f"{x:.6f}" for x in row] for row in rows)
    about = {
        "fps": motion.targets.fps,
        "columns": [*(f"root_{k}" for k in ("x", "y", "z", "qx", "qy", "qz", "qw")), *joints],
        "units": ["m"] * 3 + ["1"] * 4 + ["rad"] * len(joints),
        "world": "right-handed, z up, floor at z = 0",
        "robot": motion.robot.path.name,
    }
    header.write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")


def with_object(
    motion: RobotMotion, moved: ObjectMotion
) -> Float[np.ndarray, "frames qpos_and_object"]:
    """Return the robot's qpos, then the object's position and its quaternion (w first)."""
    T = moved.T_world_object
    turns = xyzw_from_matrix(T[:, :3, :3])[:, _W_FIRST]
    return np.hstack([motion.qpos, T[:, :3, 3], turns])


def scene_of(
    folder: Path, robot: Robot, mesh: ObjectMesh, settings: SceneSettings | None = None
) -> Any:
    """Return the mujoco.MjSpec of a scene of the robot, the object and a floor, without its file.

    The object is a free body of convex parts behind the robot. Keys of the robot are left out: they do
    not say where the object is.

    Args:
        folder: of the motion; files that the scene needs are copied into a folder of it.
        robot: whose model is taken as it is; a floor that it has is kept.
        mesh: of the object.
        settings: of the object.

    Raises:
        InputError: "robot-extra-missing" or "robot-scene".
    """
    settings = settings or SceneSettings()
    spec, parts = robot_spec(robot.path), convex_parts(mesh, settings)
    try:
        _copy_assets(spec, robot.path.parent, folder / SCENE)
        for key in spec.keys:
            spec.delete(key)
        _add_floor_and_object(spec, parts, settings)
        spec.compile()
    except (OSError, ValueError) as error:
        raise unreadable(robot.path, error, "robot-scene", "make a scene of this robot") from error
    return spec


def _add_floor_and_object(
    spec: Any, parts: list[tuple[np.ndarray, np.ndarray]], settings: SceneSettings
) -> None:
    kinds: Any = robot_package("mujoco").mjtGeom
    named = [*spec.bodies, *spec.joints, *spec.geoms, *spec.meshes]
    floor, name = (_free_name(word, [one.name for one in named]) for word in ("floor", "object"))
    # The robot's defaults are not for these.
    plain = {"contype": 1, "conaffinity": 1, "condim": 3, "friction": [1, 5e-3, 1e-4], "group": 0}
    spec.worldbody.add_light(pos=[0, 0, 4], dir=[0, 0, -1])
    floors = [g for g in spec.worldbody.geoms if g.type == kinds.mjGEOM_PLANE]
    if not any((g.contype | g.conaffinity) & 1 and abs(g.pos[2]) < 1e-6 for g in floors):
        look = {"size": [0, 0, 0.05], "rgba": [0.9, 0.9, 0.88, 1]}
        spec.worldbody.add_geom(name=floor, type=kinds.mjGEOM_PLANE, **plain, **look)
    body = spec.worldbody.add_body(name=name)
    body.add_freejoint(name=name)
    plain |= {"density": settings.density, "rgba": [0.85, 0.55, 0.25, 1]}
    for k, (vertices, faces) in enumerate(parts):
        part = f"{name}_{k}"
        mesh = spec.add_mesh(name=part, scale=[1, 1, 1])
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
        body.add_geom(name=part, type=kinds.mjGEOM_MESH, meshname=part, **plain)


def _free_name(word: str, taken: list[str]) -> str:
    while any(name == word or name.startswith(f"{word}_") for name in taken):
        word = f"omocap_{word}"
    return word


def convex_parts(
    mesh: ObjectMesh, settings: SceneSettings
) -> list[tuple[Float[np.ndarray, "verts 3"], np.ndarray]]:
    """Return convex parts that fill an object, as vertices and faces in its frame, metres."""
    coacd: Any = robot_package("coacd")
    coacd.set_log_level("error")
    whole = coacd.Mesh(mesh.vertices.astype(np.float64), mesh.faces.astype(np.int32))
    parts = coacd.run_coacd(
        whole, threshold=settings.concavity, max_convex_hull=settings.parts, seed=0
    )
    return [(np.asarray(v, float), np.asarray(f, int)) for v, f in parts]


def _copy_assets(spec: Any, home: Path, folder: Path) -> None:
    """Copy meshes, height fields, skins and pictures into `meshes`, each under a name of its own."""
    (folder / "meshes").mkdir(parents=True)

    def copied(source: str, base: str) -> str:
        path = home / base / (Path(source).name if spec.strippath else source)
        target = folder / "meshes" / path.name
        while target.exists():
            target = target.with_name(f"_{target.name}")
        shutil.copyfile(path, target)
        return target.name

    for asset in (*spec.meshes, *spec.hfields, *spec.skins):
        asset.file = asset.file and copied(asset.file, spec.meshdir)
    for texture in spec.textures:
        texture.file = texture.file and copied(texture.file, spec.texturedir)
        texture.cubefiles = [f and copied(f, spec.texturedir) for f in texture.cubefiles]
    spec.meshdir = spec.texturedir = "meshes"
    spec.strippath, spec.modelfiledir = False, str(folder)
