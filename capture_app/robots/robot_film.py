"""A robot as actors of a picture: each body's surface, carried along by its joints."""

from typing import Any

import fast_simplification
import numpy as np
import trimesh
from jaxtyping import Float

from capture_app.robots.robot_model import robot_package
from capture_app.robots.robot_solver import RobotMotion
from render.props import Actor
from render.scene import Color, Drawable, split_mesh

_FACES = 3000
"""Triangles of one part that a picture needs; models have ten times as many."""
_FINEST = 12


def robot_actors(motion: RobotMotion) -> list[Actor]:
    """Return the robot's parts along its motion, each a drawable in its geom's frame.

    Parts that are there to be seen are drawn; where a body has none, those that collide are.

    Args:
        motion: at the rate of the film.
    """
    mujoco, model = robot_package("mujoco"), motion.robot.model
    geoms = _seen(model)
    poses = np.tile(np.eye(4), (len(geoms), len(motion.qpos), 1, 1))
    data = mujoco.MjData(model)
    for frame, q in enumerate(motion.qpos):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        poses[:, frame, :3, :3] = data.geom_xmat[geoms].reshape(-1, 3, 3)
        poses[:, frame, :3, 3] = data.geom_xpos[geoms]
    parts = [(g, T, _surface(model, g, mujoco)) for g, T in zip(geoms, poses, strict=True)]
    return [
        Actor(_drawable(model, g, surface), T_world=T)
        for g, T, surface in parts
        if surface is not None
    ]


def _seen(model: Any) -> list[int]:
    """Return the geoms to draw."""
    solid = (model.geom_contype > 0) | (model.geom_conaffinity > 0)
    out: list[int] = []
    for body in range(1, model.nbody):
        own = np.flatnonzero(model.geom_bodyid == body)
        shown = own[~solid[own]]
        out += (shown if len(shown) else own).tolist()
    return out


def _drawable(model: Any, geom: int, surface: trimesh.Trimesh) -> Drawable:
    split = split_mesh(np.asarray(surface.vertices), np.asarray(surface.faces))
    color: Color = tuple(model.geom_rgba[geom, :3].tolist())
    return Drawable(f"robot part {geom}", split.vertices, split.faces, color)


def _surface(model: Any, geom: int, mujoco: Any) -> trimesh.Trimesh | None:
    """Return a geom's surface in its own frame; None for kinds that robots do not wear."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    kinds = mujoco.mjtGeom
    if kind == kinds.mjGEOM_MESH:
        return _mesh(model, int(model.geom_dataid[geom]))
    if kind == kinds.mjGEOM_SPHERE:
        return trimesh.creation.uv_sphere(radius=size[0], count=[_FINEST, _FINEST])
    if kind == kinds.mjGEOM_BOX:
        return trimesh.creation.box(extents=2 * size)
    if kind == kinds.mjGEOM_CYLINDER:
        return trimesh.creation.cylinder(radius=size[0], height=2 * size[1])
    if kind == kinds.mjGEOM_CAPSULE:
        return trimesh.creation.capsule(height=2 * size[1], radius=size[0])
    return None


def _mesh(model: Any, number: int) -> trimesh.Trimesh:
    start, count = model.mesh_vertadr[number], model.mesh_vertnum[number]
    vertices: Float[np.ndarray, "verts 3"] = model.mesh_vert[start : start + count]
    start, count = model.mesh_faceadr[number], model.mesh_facenum[number]
    faces = model.mesh_face[start : start + count]
    if len(faces) > _FACES:
        share = 1 - _FACES / len(faces)
        vertices, faces = fast_simplification.simplify(
            np.ascontiguousarray(vertices), np.ascontiguousarray(faces), share
        )[:2]
    return trimesh.Trimesh(vertices, faces, process=False)
