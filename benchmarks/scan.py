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
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from benchmarks.scan_errors import HEAD, compared
from benchmarks.scan_films import Order, camera_errors, cameras, drift, filmed
from benchmarks.scan_poisson import poisson
from ingest.scan.choices import WHOLE
from ingest.scan.clean.clean import CleanMesh, clean
from ingest.scan.clean.save import save_mesh
from ingest.scan.dense.cloud import cloud
from ingest.scan.dense.dense import dense_surface
from ingest.scan.dense.depths import measure_depths
from ingest.scan.dense.picture import SmallPictures
from ingest.scan.region.region import aim_at, find_region
from ingest.scan.silhouettes.silhouettes import find_silhouettes
from ingest.scan.types import Registered
from tests.simulator.scan_objects import OBJECTS

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
    region = find_region(registered, None, cloud(depths, aim))
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
