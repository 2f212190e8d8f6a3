"""A small film of a box, and its scan."""

from dataclasses import dataclass
from pathlib import Path

from capture_app.scanning.scan_object import ObjectScan
from tests.simulator.scan_camera import FilmErrors
from tests.simulator.scan_film import ScanFilm, film_session
from tests.simulator.scan_scene import scan_scene


@dataclass(frozen=True)
class Scanned:
    """What was filmed, what came out, and what was told meanwhile."""

    film: ScanFilm
    scan: ObjectScan
    told: tuple[tuple[str, float], ...]
    """Stages, and how far they were."""


def film_small(folder: Path, *, arc: float = 360.0) -> ScanFilm:
    """A session of a box with depth, few small pictures all around, or from `arc` degrees of the circle."""
    scene = scan_scene(21, "box")
    errors = FilmErrors(jolts=0.0)
    return film_session(
        scene, folder, count=24, width=400, seed=3, errors=errors, depth=True, arc=arc
    )
