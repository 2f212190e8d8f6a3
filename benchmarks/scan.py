"""What a scan's mesh costs and how right it is, thing by thing and method by method.

Usage: python -m benchmarks.scan [--things box,bin] [--methods stereo,depth] [--pictures 60] [--save DIR]

The project films its own things in a painted room; the cameras are the true ones but for small errors, as
they are left when they have been refined. Errors are from the mesh to the truth: of what a picture shows,
and of everything, where what no picture shows is filled. Completeness is of the part of the truth that
three pictures show. CPU seconds do not mind what else the machine does. Every line is a process of its
own, so that the peak of memory is its own too.
"""

import argparse
import multiprocessing
import resource
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import igl
import numpy as np
import trimesh

from benchmarks.scan_poisson import poisson
from capture_app.simulator.scan_film import around
from capture_app.simulator.scan_objects import OBJECTS
from capture_app.simulator.scan_scene import ScanScene, scan_scene
from capture_app.simulator.scan_views import true_views
from ingest.scan.clean.clean import CleanMesh, clean
from ingest.scan.clean.save import save_mesh
from ingest.scan.dense.dense import dense_surface
from ingest.scan.dense.picture import SmallPictures
from ingest.scan.dense.stereo import stereo_maps
from ingest.scan.region.aim import find_aim
from ingest.scan.region.region import find_region
from ingest.scan.types import Registered, no_progress
from omomo_core.geometry.distance_field import distance_field
from omomo_core.motion import ObjectMesh

METHODS = ("stereo", "depth", "both", "poisson")
SHIFT, TURN = 0.0003, 0.0002
"""Of refined cameras: metres, rad."""
_SAMPLES = 20_000
_SHOWN = 3
_HEAD = (
    f"{'thing':<11}{'method':<9}{'CPU s':>6}{'wall s':>7}{'MB':>6}{'median':>8}{'p90':>7}"
    f"{'all med':>9}{'all p90':>9}{'<1 cm':>7}{'<5 mm':>7}{'seen':>6}{'verts':>7}{'closed':>7}"
    "  (mm, parts)"
)


@dataclass(frozen=True)
class Case:
    """One line of the table."""

    thing: str
    method: str
    pictures: int
    width: int
    seed: int
    save: Path | None


def measure(case: Case) -> str:
    """Film, reconstruct, compare."""
    scene = scan_scene(case.seed, case.thing)
    poses = around(scene, case.pictures, seed=case.seed)
    with tempfile.TemporaryDirectory() as folder:
        registered = true_views(
            scene,
            poses,
            Path(folder),
            width=case.width,
            seed=case.seed,
            shift=SHIFT,
            turn=TURN,
            depth=True,
        )
        cpu, wall = time.process_time(), time.perf_counter()
        cleaned = reconstruct(registered, case.method, case.thing, Path(folder))
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    if case.save:
        case.save.mkdir(parents=True, exist_ok=True)
        save_mesh(cleaned, case.save / f"{case.thing.replace(' ', '-')}_{case.method}.glb")
    return f"{case.thing:<11}{case.method:<9}{cpu:6.0f}{wall:7.0f}{peak:6.0f}" + compared(
        cleaned, scene, poses
    )


def reconstruct(registered: Registered, method: str, name: str, work: Path) -> CleanMesh:
    """From cameras to the object's mesh; raises what its stages do."""
    aim, region = find_aim(registered.views), find_region(registered)
    if method == "poisson":
        pictures = SmallPictures(registered.views, 480)
        maps = stereo_maps(registered, pictures, aim, work, no_progress)
        vertices, faces = poisson(registered, region, maps, depth=8, trim=5.0)
        return clean(vertices, faces, None, region, name)
    surface = dense_surface(registered, region, aim, work, method=method)
    return clean(surface.vertices, surface.faces, surface.colours, region, name, seen=surface.seen)


def compared(cleaned: CleanMesh, scene: ScanScene, T_world_phone: np.ndarray) -> str:
    """Errors against the truth, in columns."""
    T = cleaned.T_world_object
    vertices = cleaned.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    mesh = trimesh.Trimesh(vertices, cleaned.mesh.faces, process=False)
    T = scene.T_world_object
    truth = trimesh.Trimesh(
        scene.mesh.vertices @ T[:3, :3].T + T[:3, 3], scene.mesh.faces, process=False
    )
    points, face = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    off = 1e3 * _distance(points, truth)
    seen = cleaned.seen[mesh.faces].all(axis=1)[face]
    short = _distance(shown(truth, T_world_phone), mesh)
    # The generation must be able to tell its inside from its outside.
    distance_field(ObjectMesh(cleaned.mesh.vertices, cleaned.mesh.faces, cleaned.mesh.name))
    numbers = [
        f"{np.median(off[seen]):8.2f}{np.percentile(off[seen], 90):7.2f}",
        f"{np.median(off):9.2f}{np.percentile(off, 90):9.2f}",
        f"{(short < 0.01).mean():7.3f}{(short < 0.005).mean():7.3f}{seen.mean():6.2f}",
        f"{len(vertices):7d}{'yes' if cleaned.watertight else 'no':>7}",
    ]
    return "".join(numbers)


def shown(truth: trimesh.Trimesh, T_world_phone: np.ndarray) -> np.ndarray:
    """Points of a surface that at least three cameras face with nothing between, world."""
    points, face = trimesh.sample.sample_surface(truth, _SAMPLES, seed=0)
    normals = truth.face_normals[face]
    count = np.zeros(len(points), int)
    for eye in T_world_phone[:, :3, 3]:
        way = eye - points
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        faces_it = np.einsum("ij,ij->i", way, normals) > 0.1
        count += faces_it & ~truth.ray.intersects_any(points + 1e-4 * normals, way)
    return points[count >= _SHOWN]


def _distance(points: np.ndarray, mesh: trimesh.Trimesh) -> np.ndarray:
    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    return np.sqrt(igl.point_mesh_squared_distance(np.asarray(points, float), vertices, faces)[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--things", default=",".join(OBJECTS))
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--pictures", type=int, default=60)
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--save", type=Path, help="folder for the meshes")
    given = parser.parse_args()
    print(_HEAD, flush=True)
    spawned = multiprocessing.get_context("spawn")
    for thing in given.things.split(","):
        for method in given.methods.split(","):
            case = Case(thing, method, given.pictures, given.width, given.seed, given.save)
            with ProcessPoolExecutor(1, mp_context=spawned) as pool:
                print(pool.submit(measure, case).result(), flush=True)


if __name__ == "__main__":
    main()
