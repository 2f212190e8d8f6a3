"""What an app would make of a mesh that stands in a session's world."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from ingest.axes import T_ZUP_ARKIT
from omomo_core.motion import ObjectMesh


def upright(seed: int) -> np.ndarray:
    """Some T_world_object of an object with z up, in a world with y up."""
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("y", rng.uniform(-3, 3)).as_matrix() @ T_ZUP_ARKIT[:3, :3].T
    T[:3, 3] = rng.uniform(-1, 1, 3)
    return T


def scanned(mesh: ObjectMesh, T: np.ndarray, seed: int, *, error: float = 0.004) -> ObjectMesh:
    """The mesh at T with bulges and noise, without its bottom, on a piece of the floor."""
    rng = np.random.default_rng(seed)
    fine = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).subdivide_to_size(0.04)
    down = (fine.face_normals[:, 2] < -0.9) & (fine.triangles_center[:, 2] < 0.02)
    waves, phases = 8 * rng.normal(size=(3, 3, 12)), rng.uniform(0, 6.28, (3, 12))
    bulges = np.stack(
        [np.sin(fine.vertices @ waves[k] + phases[k]).sum(axis=1) / np.sqrt(6) for k in range(3)], 1
    )
    vertices = fine.vertices + error * bulges + rng.normal(0, 0.001, fine.vertices.shape)
    vertices = vertices @ T[:3, :3].T + T[:3, 3]
    floor = trimesh.creation.box((1.6, 0.002, 1.6)).subdivide_to_size(0.1)
    under = floor.vertices + np.array([T[0, 3] + 0.1, vertices[:, 1].min(), T[2, 3] - 0.2])
    return ObjectMesh(
        np.concatenate([vertices, under]),
        np.concatenate([fine.faces[~down], floor.faces + len(vertices)]),
        "scan",
    )
