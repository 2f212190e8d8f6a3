"""Sessions made up for the tests."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession, ImuLog
from omomo_core.motion import ObjectMesh

MakeSession = Callable[..., CaptureSession]


def _wander(seed: int, seconds: float = 3.0, rate: float = 60.0) -> CaptureSession:
    """A smooth random walk of a phone with everything a log can hold."""
    rng = np.random.default_rng(seed)
    clock = np.arange(int(seconds * rate) + 1) / rate
    waves = [
        rng.uniform(-0.15, 0.15, 3) * np.sin(np.outer(clock, [f] * 3)) for f in (1.0, 2.3, 3.7)
    ]
    turns = [rng.uniform(-0.4, 0.4, 3) * np.sin(np.outer(clock, [f] * 3)) for f in (0.7, 1.9)]
    T = np.tile(np.eye(4), (len(clock), 1, 1))
    T[:, :3, :3] = (Rotation.from_rotvec(sum(turns)) * Rotation.random(rng=rng)).as_matrix()
    T[:, :3, 3] = sum(waves) + rng.uniform(-2, 2, 3)
    times = 65575.5 + clock
    return CaptureSession(
        app="test",
        source=Path("made up"),
        times=times,
        T_world_phone=T,
        intrinsics=np.array([1460, 1460, 960, 720]) + rng.uniform(-9, 9, (len(times), 4)),
        image_size=(1920, 1440),
        video_times=times,
        imu=ImuLog(
            times + 0.001, rng.normal(0, 10, T[:, :3, 3].shape), rng.normal(size=(len(T), 3))
        ),
    )


@pytest.fixture(scope="session")
def wander() -> MakeSession:
    return _wander


@pytest.fixture(scope="session")
def box() -> ObjectMesh:
    """A box of 0.4 x 0.3 x 0.5 m, its frame at the middle of its bottom."""
    corners = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (-0.15, 0.15) for z in (0, 0.5)])
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]])
    return ObjectMesh(corners, faces, "box")
