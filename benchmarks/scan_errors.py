"""A scan's mesh against the truth."""

import igl
import numpy as np
import trimesh
from jaxtyping import Float64

from ingest.scan.clean_mesh import CleanMesh
from omomo_core.geometry.distance_field import distance_field
from omomo_core.motion import ObjectMesh
from tests.simulator.scan_film import ScanFilm

_SAMPLES = 20_000
_SHOWN = 3
HEAD = (
    f"{'thing':<11}{'method':<9}{'CPU s':>6}{'wall s':>7}{'MB':>6}{'median':>8}{'p90':>7}{'world':>7}"
    f"{'all med':>9}{'all p90':>9}{'<1 cm':>7}{'<5 mm':>7}{'seen':>6}{'verts':>7}{'closed':>7}"
    "  (mm, parts)"
)


def compared(cleaned: CleanMesh, film: ScanFilm, T_found_true: Float64[np.ndarray, "4 4"]) -> str:
    """Errors against the truth, in columns.

    Args:
        cleaned: the mesh.
        film: what it was made of.
        T_found_true: where the true world lies in the one that was found.
    """
    scene, T_found_world = film.scene, T_found_true @ film.T_scan_world
    mesh = _placed(cleaned.mesh.vertices, cleaned.mesh.faces, cleaned.T_world_object)
    truth = _placed(scene.mesh.vertices, scene.mesh.faces, T_found_world @ scene.T_world_object)
    logged = _placed(scene.mesh.vertices, scene.mesh.faces, film.T_scan_object)
    points, face = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    off = 1e3 * distance(points, truth)
    seen = cleaned.seen[cleaned.mesh.faces].all(axis=1)[face]
    in_world = 1e3 * distance(points[seen], logged)
    short = distance(shown(truth, T_found_world @ film.T_world_phone), mesh)
    # The generation must be able to tell its inside from its outside.
    distance_field(ObjectMesh(cleaned.mesh.vertices, cleaned.mesh.faces, cleaned.mesh.name))
    numbers = [
        f"{np.median(off[seen]):8.2f}{np.percentile(off[seen], 90):7.2f}{np.median(in_world):7.2f}",
        f"{np.median(off):9.2f}{np.percentile(off, 90):9.2f}",
        f"{(short < 0.01).mean():7.3f}{(short < 0.005).mean():7.3f}{seen.mean():6.2f}",
        f"{len(cleaned.mesh.vertices):7d}{'yes' if cleaned.watertight else 'no':>7}",
    ]
    return "".join(numbers)


def _placed(vertices: np.ndarray, faces: np.ndarray, T: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(vertices @ T[:3, :3].T + T[:3, 3], faces, process=False)


def shown(truth: trimesh.Trimesh, T_world_phone: np.ndarray) -> np.ndarray:
    """Points of a surface that at least three cameras face with nothing between, in the same world."""
    points, face = trimesh.sample.sample_surface(truth, _SAMPLES, seed=0)
    normals = truth.face_normals[face]
    count = np.zeros(len(points), int)
    for eye in T_world_phone[:, :3, 3]:
        way = eye - points
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        faces_it = np.einsum("ij,ij->i", way, normals) > 0.1
        count += faces_it & ~truth.ray.intersects_any(points + 1e-4 * normals, way)
    return points[count >= _SHOWN]


def distance(points: np.ndarray, mesh: trimesh.Trimesh) -> np.ndarray:
    """Metres from points to a surface."""
    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    return np.sqrt(igl.point_mesh_squared_distance(np.asarray(points, float), vertices, faces)[0])
