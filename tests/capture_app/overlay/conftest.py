"""A result of a person who holds still while a box is turned before them, and a camera that watches."""

import pytest

from capture_app.result import Result
from tests.capture_app.overlay.taken import LENS, Watched, phone_take, standing, write_result
from tests.simulator.wiggle import wiggle_motion
from tests.simulator.witness import tripod


@pytest.fixture(scope="session")
def watched() -> Watched:
    motion = wiggle_motion("all axes", seconds=14.0, seed=3)
    witness = tripod(distance=1.6, size=(1280, 720), distortion=LENS, rate=12.0, start=0.97)
    return Watched(motion, standing(len(motion.valid), -0.5), witness)


@pytest.fixture(scope="session")
def result(watched: Watched, tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Of an object that moved by itself."""
    return write_result(tmp_path_factory.mktemp("take") / "result", watched)


@pytest.fixture(scope="session")
def phone_result(watched: Watched, tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Of an object with a phone, for a second; it filmed grey pictures."""
    return phone_take(watched, tmp_path_factory.mktemp("phone"))
