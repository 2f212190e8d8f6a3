"""The project's own things filmed with known truth, and where their cameras are found to be."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from capture_app.simulator.phone import arkit_from_world
from ingest.axes import T_ZUP_ARKIT
from ingest.formats.axes import T_OPENCV_ARKIT_CAMERA
from ingest.scan.cameras.register import register
from ingest.scan.frames import pick_frames
from ingest.scan.sources.read import read_source
from ingest.scan.types import Registered
from omomo_core.geometry.procrustes import procrustes
from tests.simulator.scan_film import ScanFilm, around, film_session
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
