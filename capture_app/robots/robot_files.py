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

from capture_app.robots.robot_model import Robot, robot_package, robot_spec
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
    folder: Path,
    motion: RobotMotion,
    moved: ObjectMotion,
    settings: SceneSettings | None = None,
) -> tuple[Path, ...]:
    """Write all files of a robot's motion into a folder, and return their paths.

    Args:
        folder: exists, and is empty.
        motion: at the rate of the files.
        moved: the object, as many frames.
        settings: of the scene.

    Raises:
        InputError: "robot-extra-missing".
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
    scene = write_scene(folder / SCENE, motion.robot, moved.mesh, qpos[0], settings)
    return table, header, arrays, scene


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


def write_scene(
    folder: Path,
    robot: Robot,
    mesh: ObjectMesh,
    qpos: Float[np.ndarray, " qpos_and_object"],
    settings: SceneSettings | None = None,
) -> Path:
    """Write a MuJoCo scene of the robot, the object and a floor, and return its file.

    The object is a free body of convex parts behind the robot; the key "start" holds the first frame.

    Args:
        folder: is made; the robot's meshes are copied into it.
        robot: whose model is taken as it is.
        mesh: of the object.
        qpos: of the first frame, the object's last.
        settings: of the object.

    Raises:
        InputError: "robot-extra-missing".
    """
    settings, mujoco = settings or SceneSettings(), robot_package("mujoco")
    folder.mkdir()
    spec = robot_spec(robot.path)
    _copy_meshes(spec, robot.path.parent, folder / "meshes")
    spec.meshdir = "meshes"
    spec.worldbody.add_light(pos=[0, 0, 4], dir=[0, 0, -1])
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], rgba=[0.9, 0.9, 0.88, 1]
    )
    body = spec.worldbody.add_body(name="object")
    body.add_freejoint(name="object")
    for k, (vertices, faces) in enumerate(convex_parts(mesh, settings)):
        name = f"object_{k}"
        spec.add_mesh(name=name, uservert=vertices.ravel(), userface=faces.ravel())
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            density=settings.density,
            rgba=[0.85, 0.55, 0.25, 1],
        )
    spec.add_key(name="start", qpos=qpos)
    scene = folder / "scene.xml"
    # A model is complete only once it has been compiled, and needs its meshes for that.
    spec.modelfiledir = str(folder)
    spec.compile()
    scene.write_text(spec.to_xml(), encoding="utf-8")
    return scene


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


def _copy_meshes(spec: Any, home: Path, folder: Path) -> None:
    folder.mkdir()
    for mesh in spec.meshes:
        if mesh.file:
            source = home / spec.meshdir / mesh.file
            target = folder / Path(mesh.file).name
            shutil.copyfile(source, target)
            mesh.file = target.name
