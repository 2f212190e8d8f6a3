"""Small films of a box for the tests of sources, frames and cameras."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from capture_app.simulator.simulated_phone import PhoneNoise
from ingest.calibration.board.board_spec import Board, board_image
from ingest.scan.scan_types import Registered
from omomo_core.geometry.transforms import procrustes
from render.scene import Drawable
from tests.simulator.scan_camera import FilmErrors
from tests.simulator.scan_film import ScanFilm, film_session
from tests.simulator.scan_scene import ScanScene, scan_scene

WIDTH, COUNT = 480, 30
STEADY = FilmErrors(jolts=0.0, poses=PhoneNoise(jitter_m=0.002, jitter_deg=0.15, drift=0.0015))


def film_box(folder: Path, *, depth: bool = False, errors: FilmErrors = STEADY) -> ScanFilm:
    """A session of a box, few small pictures all around."""
    scene = scan_scene(21, "box")
    return film_session(scene, folder, count=COUNT, width=WIDTH, seed=3, errors=errors, depth=depth)


def truth(film: ScanFilm, found: Registered) -> Float64[np.ndarray, "views 4 4"]:
    """T_scan_camera of the registered pictures, OpenCV's axes."""
    places = [int("".join(c for c in view.name if c.isdigit())) for view in found.views]
    return film.T_scan_world @ film.T_world_phone[places] @ np.diag([1.0, -1.0, -1.0, 1.0])


def off(film: ScanFilm, found: Registered) -> tuple[float, float]:
    """Error of the scale as a part, and median error of the cameras' places without it, metres."""
    T = np.array([view.T_world_camera for view in found.views])
    real = truth(film, found)[:, :3, 3]
    fit = procrustes(real, T[:, :3, 3], np.ones(len(T)), scaled=True)
    return 1 / fit.scale - 1, float(np.median(np.linalg.norm(fit.residuals, axis=1)))


def with_board(scene: ScanScene, board: Board) -> ScanScene:
    """The scene with a board on the floor beside the thing."""
    per_mm, border = 2.0, 20.0
    size = np.array([1e3 * board.width, 1e3 * board.height]) + 2 * border
    picture = board_image(board, *np.rint(size * per_mm).astype(int).tolist(), per_mm)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    flat = (square - 0.5) * size * [1.0, -1.0] / 1e3
    corners = np.concatenate([flat, np.full((4, 1), 0.002)], axis=1)
    place = scene.T_world_object[:3, 3] + [0.45, 0.1, 0.0]
    paper = Drawable(
        "board",
        corners + place,
        np.array([[0, 2, 1], [0, 3, 2]]),
        uv=square,
        texture=np.repeat(picture[..., None], 3, axis=2),
        casts_shadow=False,
    )
    return replace(scene, beside=(paper,))
