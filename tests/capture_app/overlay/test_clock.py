"""The offset of a film whose camera stood still, by what moves in it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capture_app.overlay.overlay_film import TimedPictures, open_video
from capture_app.overlay.placing import clock_offset
from capture_app.simulator.demo_take import carried_box
from ingest.calibration.board.board_spec import PRESETS
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMotion
from render.video import write_video
from tests.simulator.witness import Witness, film, tripod

# Made in conftest.py.
Watched = Any
AWAY = np.diag([1.0, 1, 1, 1])


def filmed(motion: ObjectMotion, witness: Witness, path: Path) -> TimedPictures:
    """What the witness filmed; the board is off the picture."""
    far = AWAY.copy()
    far[2, 3] = 50.0
    write_video(path, film(motion, PRESETS["A4"], far, witness), witness.rate)
    return open_video(path)


@pytest.fixture(scope="module")
def carried(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[ObjectMotion, Witness, TimedPictures]:
    """A box that is lifted, carried and put down, seen from across the room."""
    motion = carried_box()
    middle = motion.T_world_object[:, :3, 3].mean(axis=0)
    lens = (0.1, -0.15, 0.001, -0.001, 0.0)
    size = (320, 180)
    witness = tripod(middle, distance=4.0, size=size, distortion=lens, rate=10.0, start=1.3)
    return motion, witness, filmed(motion, witness, tmp_path_factory.mktemp("clock") / "film.mp4")


def offset_of(film_: TimedPictures, motion: ObjectMotion, witness: Witness) -> float:
    camera = witness.camera
    return clock_offset(film_, motion, witness.T_world_camera, camera.K, camera.lens)


def test_a_film_tells_when_it_began(carried: tuple[ObjectMotion, Witness, TimedPictures]) -> None:
    motion, witness, taken = carried
    assert offset_of(taken, motion, witness) == pytest.approx(witness.start, abs=0.07)


def test_the_clock_of_a_film_that_counts_from_elsewhere(
    carried: tuple[ObjectMotion, Witness, TimedPictures],
) -> None:
    motion, witness, taken = carried
    late = replace(taken, times=taken.times + 100.0)
    assert offset_of(late, motion, witness) == pytest.approx(witness.start - 100.0, abs=0.07)


def test_another_motion_is_not_found_in_it(
    carried: tuple[ObjectMotion, Witness, TimedPictures],
) -> None:
    motion, witness, taken = carried
    still = replace(
        motion,
        T_world_object=np.repeat(motion.T_world_object[:1], 300, axis=0),
        valid=np.ones(300, bool),
    )
    backwards = replace(motion, T_world_object=motion.T_world_object[::-1].copy())
    for other in (still, backwards):
        with pytest.raises(InputError) as refused:
            offset_of(taken, other, witness)
        assert refused.value.code == "offset-needed"
        assert "‹offset›" in refused.value.fix
