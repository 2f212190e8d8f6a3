"""A box filmed with LiDAR, and its scan as `omocap scan` makes it: once for all tests."""

from pathlib import Path

import pytest

from capture_app.commands.scan import ScanRequest
from capture_app.scanning.scan_object import scan_object
from tests.capture_app.scanning.filmed import Scanned, film_small
from tests.once import once


@pytest.fixture(scope="session")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Scanned:
    return once(tmp_path_factory, "scanning", _scan)


def _scan(folder: Path) -> Scanned:
    film = film_small(folder / "film")
    request = ScanRequest(
        source=film.path, output=folder / "box.glb", method="depth", vertices=2000
    )
    told: list[tuple[str, float]] = []
    made = scan_object(request, lambda stage, done: told.append((stage, done)))
    return Scanned(film, made, tuple(told))
