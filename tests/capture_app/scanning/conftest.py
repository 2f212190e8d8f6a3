"""A box filmed with LiDAR, and its scan as `omocap scan` makes it: once for all tests."""

import pytest

from capture_app.commands.scan import ScanRequest
from capture_app.scanning.scan import scan_object
from tests.capture_app.scanning.filmed import Scanned, film_small


@pytest.fixture(scope="session")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Scanned:
    folder = tmp_path_factory.mktemp("scanning")
    film = film_small(folder / "film")
    request = ScanRequest(
        source=film.path, output=folder / "box.glb", method="depth", vertices=2000
    )
    told: list[tuple[str, float]] = []
    made = scan_object(request, lambda stage, done: told.append((stage, done)))
    return Scanned(film, made, tuple(told))
