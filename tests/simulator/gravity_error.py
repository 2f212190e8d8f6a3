"""Sessions whose world is not quite level, as ARKit's error of gravity leaves it."""

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession

WANDER_SECONDS = 20.0
"""Time in which the wandering part forgets what it was."""


def unlevel(
    session: CaptureSession, *, whole_deg: float = 0.4, wander_deg: float = 0.3, seed: int
) -> CaptureSession:
    """The session in a world that leans, with poses whose tilt wanders about it.

    Args:
        session: of a world whose y is exactly up.
        whole_deg: standard deviation, on each horizontal axis, of the lean of the whole world.
        wander_deg: the same of what comes and goes; it turns the phone where it is.
        seed: the same seed gives the same errors.
    """
    rng = np.random.default_rng(seed)
    count = len(session.times)
    period = float(np.median(np.diff(session.times)))
    keep = np.exp(-period / WANDER_SECONDS)
    steps = np.sqrt(1 - keep**2) * rng.standard_normal((count, 2))
    steps[0] = rng.standard_normal(2)
    wander = np.radians(wander_deg) * lfilter([1.0], [1.0, -keep], steps, axis=0)
    turns = np.stack([wander[:, 0], np.zeros(count), wander[:, 1]], axis=1)
    lean = np.radians(whole_deg) * rng.standard_normal(2)
    world = Rotation.from_rotvec([lean[0], 0.0, lean[1]])
    T = session.T_world_phone.copy()
    T[:, :3, :3] = (
        world * Rotation.from_rotvec(turns) * Rotation.from_matrix(T[:, :3, :3])
    ).as_matrix()
    T[:, :3, 3] = world.apply(T[:, :3, 3])
    return replace(session, T_world_phone=T)
