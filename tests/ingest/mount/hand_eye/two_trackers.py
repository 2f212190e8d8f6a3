"""One motion seen by a phone and by another tracker, with the truth of both."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from capture_app.simulator.noise import PhoneNoise, disturb
from ingest.mount.hand_eye.streams import PoseStream
from ingest.mount.uncertainty import moved
from omomo_core.geometry.transforms import inverse

PHONE_CLOCK, TARGET_CLOCK = 65_000.0, 12.0


@dataclass(frozen=True)
class TwoTrackers:
    phone: PoseStream
    target: PoseStream
    T_phone_target: np.ndarray
    T_world_camera: np.ndarray
    offset: float
    """Seconds to add to the target's times."""


def two_trackers(
    seed: int,
    kind: str = "all",
    *,
    noise: float = 1.0,
    drift: float = 0.005,
    wild: float = 0.1,
    seconds: float = 20.0,
) -> TwoTrackers:
    """A phone at 60 Hz and a target's poses at 15 Hz.

    Args:
        seed: of everything.
        kind: "all" (turns about all axes), "yaw" (pushed over the floor), "shift" (never turned) or
            "tiny" (a few degrees).
        noise: times 0.23 deg and 0.5 mm (3 mm in depth) of the target's poses.
        drift: of the phone, as a part of its path.
        wild: part of the target's poses that are anything.
        seconds: how long.
    """
    rng = np.random.default_rng(seed)
    P = _path(kind, seconds, rng)
    X, Z = _pose(rng, 0.4), _pose(rng, 2.0)
    times, seen_at = np.arange(0, seconds, 1 / 60), np.arange(0.1, seconds - 0.1, 1 / 15)
    offset = PHONE_CLOCK - TARGET_CLOCK + rng.uniform(-0.2, 0.2)
    sd = noise * np.array([4e-3] * 3 + [5e-4, 5e-4, 3e-3]) + 1e-5
    O = moved(inverse(Z) @ P(seen_at) @ X, rng.normal(size=(len(seen_at), 6)) * sd)  # noqa: E741
    lost = rng.random(len(O)) < wild
    O[lost] = moved(O[lost], rng.normal(size=(lost.sum(), 6)) * [1, 1, 1, 0.2, 0.2, 0.2])
    phone = disturb(P(times), PhoneNoise(drift=drift), rng)
    return TwoTrackers(
        PoseStream(PHONE_CLOCK + times, phone),
        PoseStream(PHONE_CLOCK + seen_at - offset, O, np.tile(np.diag(sd**2), (len(O), 1, 1))),
        X,
        Z,
        offset,
    )


def _path(kind: str, seconds: float, rng: np.random.Generator):
    knots = np.arange(0, seconds + 1)
    place = np.cumsum(rng.normal(size=(len(knots), 3)) * [0.15, 0.02, 0.15], axis=0)
    turns = rng.normal(size=(len(knots), 3)) * np.radians(
        {"all": [25, 40, 25], "yaw": [0, 55, 0], "shift": [0, 0, 0], "tiny": [1, 1, 1]}[kind]
    )
    if kind == "yaw":
        place[:, 1] = 0.0
    turning = RotationSpline(knots, Rotation.from_rotvec(turns) * Rotation.random(rng=rng))
    moving = CubicSpline(knots, place)

    def poses(times: np.ndarray) -> np.ndarray:
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3], T[:, :3, 3] = turning(times).as_matrix(), moving(times)
        return T

    return poses


def _pose(rng: np.random.Generator, reach: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-reach, reach, 3)
    return T
