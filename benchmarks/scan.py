"""What a scan's mesh costs and how right it is, thing by thing and method by method.

Usage: python -m benchmarks.scan [--things box,bin] [--methods stereo,depth] [--true-cameras]
                                 [--films DIR] [--save DIR]

The project films its own things in a painted room, with the errors of a phone, and goes the whole way:
pictures picked, cameras found, object found, surface, clean mesh. The true cameras are laid on those found,
without a change of size, and the truth moves with them. Errors are distances from the mesh to it: of what
pictures show, and of everything, where what no picture shows is filled. "world" is the median of the former
where the truth stays in the phone's world, which drifts by some millimetres during a film. Completeness is of
the part of the truth that three pictures show.
CPU seconds do not mind what else the machine does. Every line is a process of its own, so that the peak
of memory is its own too. --true-cameras takes the true cameras but for small errors instead.
"""

import argparse
import multiprocessing
import resource
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import trimesh
from jaxtyping import Float64

from benchmarks.scan_errors import HEAD, compared
from capture_app.simulator.simulated_phone import arkit_from_world
from ingest.axes import T_ZUP_ARKIT
from ingest.colmap import pycolmap
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.scan.cameras.register import register
from ingest.scan.clean_mesh import CleanMesh, clean, save_mesh
from ingest.scan.dense.dense import dense_surface
from ingest.scan.dense.depth_maps import measure_depths, surface_points
from ingest.scan.dense.stereo import SmallPictures, matrix_for, pixel_rays
from ingest.scan.region import aim_at, find_region
from ingest.scan.scan_choices import WHOLE
from ingest.scan.scan_pictures import pick_frames
from ingest.scan.scan_sources import read_source
from ingest.scan.scan_types import Region, Registered
from ingest.scan.silhouettes import find_silhouettes
from omomo_core.geometry.transforms import inverse, procrustes
from tests.simulator.scan_film import ScanFilm, around, film_session
from tests.simulator.scan_objects import OBJECTS
from tests.simulator.scan_scene import scan_scene
from tests.simulator.scan_views import true_views

SHIFT, TURN = 0.0003, 0.0002
"""Of cameras that are given nearly as they were: metres, rad."""


@dataclass(frozen=True)
class Order:
    """What is filmed, and how."""

    thing: str
    pictures: int
    width: int
    seed: int
    """Of the thing's place and of all paint."""
    folder: Path
    """Keeps the films and what is made of them."""
    true_cameras: bool

    @property
    def name(self) -> str:
        """Of the thing, for files."""
        return self.thing.replace(" ", "_")

    @property
    def work(self) -> Path:
        """Where the scan works."""
        return self.folder / f"{self.name}.work"


def filmed(order: Order) -> ScanFilm:
    """The film of a thing, of an earlier time if there is one."""
    scene = scan_scene(order.seed, order.thing)
    path = order.folder / order.name
    if order.true_cameras or path.is_dir():
        T = around(scene, order.pictures)
        T_scan_world = T_ZUP_ARKIT @ arkit_from_world(T[0])
        return ScanFilm(
            scene, path, T, np.eye(4) if order.true_cameras else T_scan_world, order.width
        )
    return film_session(scene, path, count=order.pictures, width=order.width, depth=True)


def cameras(order: Order, film: ScanFilm) -> Registered:
    """As `omocap scan` finds them; or the true ones, but for small errors."""
    if order.true_cameras:
        return true_views(
            film.scene,
            film.T_world_phone,
            order.work,
            width=order.width,
            shift=SHIFT,
            turn=TURN,
            depth=True,
        )
    source = read_source(film.path)
    return register(source, pick_frames(source, order.work), order.work)


def drift(film: ScanFilm, found: Registered) -> Float64[np.ndarray, "4 4"]:
    """Return T_found_true, which lays the true cameras on those found, without a change of size."""
    true, T = _cameras(film, found)
    fit = procrustes(T[:, :3, 3], true[:, :3, 3], np.ones(len(T)))
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = fit.R, fit.t
    return moved


def _cameras(
    film: ScanFilm, found: Registered
) -> tuple[Float64[np.ndarray, "views 4 4"], Float64[np.ndarray, "views 4 4"]]:
    """The cameras of all views, true and found, in the scan's world."""
    places = [int(view.name[:5]) for view in found.views]
    true = film.T_scan_world @ film.T_world_phone[places] @ T_OPENCV_ARKIT_CAMERA
    return true, np.array([view.T_world_camera for view in found.views])


def camera_errors(film: ScanFilm, found: Registered) -> str:
    """Scale (percent), places and directions once the scale is right, in columns."""
    true, T = _cameras(film, found)
    fit = procrustes(true[:, :3, 3], T[:, :3, 3], np.ones(len(T)), scaled=True)
    turned = fit.R @ T[:, :3, :3] @ true[:, :3, :3].swapaxes(1, 2)
    cosine = (np.trace(turned, axis1=1, axis2=2) - 1) / 2
    placed = f"{len(found.views)}/{len(found.views) + len(found.left_out)}"
    return (
        f"{placed:>8} placed, {found.reprojection:.2f} px, scale {100 * (1 / fit.scale - 1):+.3f} % "
        f"(said {100 * found.scale.sigma:.2f}), "
        f"{1e3 * np.median(np.linalg.norm(fit.residuals, axis=1)):.2f} mm, "
        f"{np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1))):.3f} degrees"
    )


_FLOOR = 0.01
_STRIDE = 2


def poisson(
    registered: Registered, region: Region, maps: Sequence[np.ndarray], depth: int, trim: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of the Poisson surface of what depth maps show in a region (world)."""
    points, normals = _oriented(registered, region, maps)
    with tempfile.TemporaryDirectory() as folder:
        cloud, mesh = Path(folder) / "in.ply", Path(folder) / "out.ply"
        _write(cloud, points, normals)
        pycolmap.poisson_meshing(
            cloud, mesh, pycolmap.PoissonMeshingOptions(depth=depth, trim=trim, color=False)
        )
        found = trimesh.load_mesh(mesh, process=False)
    return np.asarray(found.vertices, np.float64), np.asarray(found.faces, np.int64)


def _oriented(
    registered: Registered, region: Region, maps: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Points in the region above its floor, and normals towards the views, world."""
    points, normals = list[np.ndarray](), list[np.ndarray]()
    T_floor_world = inverse(region.T_world_floor)
    for view, depth in zip(registered.views, maps, strict=True):
        T = view.T_world_camera
        rays = pixel_rays(depth.shape, matrix_for(view, depth.shape[::-1]))
        placed = rays * cv2.medianBlur(depth, 3)[..., None]
        across, down = (np.gradient(placed, axis=axis) for axis in (1, 0))
        normal = -np.cross(across, down)
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        world = placed.astype(float) @ T[:3, :3].T + T[:3, 3]
        standing = world @ T_floor_world[:3, :3].T + T_floor_world[:3, 3]
        low = region.low + np.array([0.0, 0.0, _FLOOR])
        inside = ((standing > low) & (standing < region.high)).all(axis=-1) & (depth > 0)
        smooth = np.linalg.norm(across, axis=-1) < 0.05 * np.maximum(depth, 1e-3)
        kept = (inside & smooth & (length[..., 0] > 0))[::_STRIDE, ::_STRIDE]
        points.append(world[::_STRIDE, ::_STRIDE][kept])
        normals.append(
            (normal / np.maximum(length, 1e-12) @ T[:3, :3].T)[::_STRIDE, ::_STRIDE][kept]
        )
    return np.concatenate(points), np.concatenate(normals)


def _write(path: Path, points: np.ndarray, normals: np.ndarray) -> None:
    fields = ["x", "y", "z", "nx", "ny", "nz"]
    head = "".join(f"property float {name}\n" for name in fields)
    with path.open("wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n".encode())
        file.write(f"{head}end_header\n".encode())
        file.write(np.hstack([points, normals]).astype("<f4").tobytes())


METHODS = ("stereo", "depth", "both", "poisson")


def place_cameras(order: Order) -> str:
    """Film, find the cameras; the line of the table."""
    film = filmed(order)
    spent = _Spent()
    found = cameras(order, film)
    return f"{order.thing:<11}{'cameras':<9}{spent}{camera_errors(film, found)}"


def make_mesh(order: Order, method: str, save: Path | None) -> str:
    """From cameras that are found already to the mesh; the line of the table."""
    film = filmed(order)
    registered = cameras(order, film)
    spent = _Spent()
    cleaned = reconstruct(registered, method, order.thing, order.work)
    line = f"{order.thing:<11}{method:<9}{spent}"
    if save:
        save.mkdir(parents=True, exist_ok=True)
        save_mesh(cleaned, save / f"{order.name}_{method}.glb")
    return line + compared(cleaned, film, drift(film, registered))


class _Spent:
    """Seconds since it was made, and the process's peak of memory, in columns."""

    def __init__(self) -> None:
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    def __str__(self) -> str:
        cpu, wall = time.process_time() - self._cpu, time.perf_counter() - self._wall
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        return f"{cpu:6.0f}{wall:7.0f}{peak:6.0f}"


def reconstruct(registered: Registered, method: str, name: str, work: Path) -> CleanMesh:
    """From cameras to the object's mesh; raises what its stages do."""
    aim = aim_at(registered.views, None)
    by = method if method in ("depth", "both") else "stereo"
    depths = measure_depths(registered, aim, work, method=by)
    region = find_region(registered, None, surface_points(depths, aim))
    if method == "poisson":
        vertices, faces = poisson(registered, region, depths.kinds[0], depth=8, trim=5.0)
        return clean(vertices, faces, None, region, name)
    masks = find_silhouettes(SmallPictures(registered.views, WHOLE.outlined), depths, region)
    surface = dense_surface(depths, region, masks=masks)
    return clean(surface.vertices, surface.faces, surface.colours, region, name, seen=surface.seen)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--things", default=",".join(OBJECTS))
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--pictures", type=int, default=72)
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--true-cameras", action="store_true")
    parser.add_argument("--films", type=Path, help="folder that keeps films and cameras")
    parser.add_argument("--save", type=Path, help="folder for the meshes")
    given = parser.parse_args()
    print(HEAD, flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.films or Path(temporary)
        for thing in given.things.split(","):
            order = Order(
                thing, given.pictures, given.width, given.seed, folder, given.true_cameras
            )
            _alone(place_cameras, order)
            for method in given.methods.split(","):
                _alone(make_mesh, order, method, given.save)


def _alone(line: Callable[..., str], *words: object) -> None:
    """Print a line that is made in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        print(pool.submit(line, *words).result(), flush=True)


if __name__ == "__main__":
    main()
