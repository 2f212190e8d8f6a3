"""One motion seen by a phone and by another tracker, with the truth of both."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from capture_app.simulator.simulated_phone import PhoneNoise, disturb
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.uncertainty import moved
from omomo_core.geometry.transforms import inverse

PHONE_CLOCK, TARGET_CLOCK = 65_000.0, 12.0


@dataclass(frozen=True)
class Coloured:
    """Errors that go on from one moment to the next, as those of real trackers do."""

    pose_deg: float = 0.0
    pose_mm: float = 0.0
    """Of the target's pose, on each axis; standard deviations, as all that follow."""
    stamp_s: float = 0.0
    """Of the target's stamps."""
    seconds: float = 1.0
    """Over which these go on (exponential correlation)."""
    scale: float = 0.0
    """Part by which all of the phone's distances err."""
    turn_deg: float = 0.0
    """By which the phone's world turns in the square root of a second."""
    alike_deg: float = 0.0
    alike_mm: float = 0.0
    """Of the target's frame, alike through the whole recording."""


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
    coloured: Coloured | None = None,
) -> TwoTrackers:
    """A phone at 60 Hz and a target's poses at 15 Hz.

    Args:
        seed: of everything.
        kind: "all" (turns about all axes), "yaw" (pushed over the floor), "shift" (never turned),
            "tiny" (a few degrees) or "slow" (some degrees about one axis).
        noise: times 0.23 deg and 0.5 mm (3 mm in depth) of the target's poses.
        drift: of the phone, as a part of its path.
        wild: part of the target's poses that are anything.
        seconds: how long.
        coloured: errors beside those; then the target's tracker does not tell how it errs.
    """
    rng = np.random.default_rng(seed)
    P = _path(kind, seconds, rng)
    X, Z = _pose(rng, 0.4), _pose(rng, 2.0)
    times, seen_at = np.arange(0, seconds, 1 / 60), np.arange(0.1, seconds - 0.1, 1 / 15)
    offset = PHONE_CLOCK - TARGET_CLOCK + rng.uniform(-0.2, 0.2)
    sd = noise * np.array([4e-3] * 3 + [5e-4, 5e-4, 3e-3]) + 1e-5
    truth = inverse(Z) @ P(seen_at) @ X
    if coloured is not None:
        truth = _seen(coloured, lambda times: inverse(Z) @ P(times) @ X, seen_at, rng)
    O = moved(truth, rng.normal(size=(len(seen_at), 6)) * sd)  # noqa: E741
    lost = rng.random(len(O)) < wild
    O[lost] = moved(O[lost], rng.normal(size=(lost.sum(), 6)) * [1, 1, 1, 0.2, 0.2, 0.2])
    phone = disturb(P(times), PhoneNoise(drift=drift), rng)
    if coloured is not None:
        phone = _logged(coloured, phone, rng)
    told = None if coloured is not None else np.tile(np.diag(sd**2), (len(O), 1, 1))
    return TwoTrackers(
        PoseStream(PHONE_CLOCK + times, phone),
        PoseStream(PHONE_CLOCK + seen_at - offset, O, told),
        X,
        Z,
        offset,
    )


def _seen(
    errors: Coloured,
    truth: Callable[[np.ndarray], np.ndarray],
    times: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """The target's poses as a tracker has them whose errors go on."""
    late = errors.stamp_s * _going_on(times, errors.seconds, 1, rng)[:, 0]
    sd = np.repeat([np.radians(errors.pose_deg), 1e-3 * errors.pose_mm], 3)
    alike = np.repeat([np.radians(errors.alike_deg), 1e-3 * errors.alike_mm], 3)
    poses = truth(np.clip(times + late, 0, times[-1])) @ moved(
        np.eye(4), rng.normal(size=6) * alike
    )
    return moved(poses, sd * _going_on(times, errors.seconds, 6, rng))


def _logged(errors: Coloured, T: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The phone's poses (60 Hz) in a world that turns, with distances that err."""
    step = np.radians(errors.turn_deg) / np.sqrt(60)
    turn = Rotation.from_rotvec(np.cumsum(rng.normal(size=(len(T), 3)) * step, axis=0)).as_matrix()
    out = T.copy()
    middle = T[:, :3, 3].mean(axis=0)
    out[:, :3, :3] = turn @ T[:, :3, :3]
    away = (T[:, :3, 3] - middle) * (1 + errors.scale * rng.normal())
    out[:, :3, 3] = middle + np.einsum("nij,nj->ni", turn, away)
    return out


def _going_on(times: np.ndarray, seconds: float, many: int, rng: np.random.Generator) -> np.ndarray:
    """Signals of unit variance whose correlation falls by e in so many seconds."""
    out = rng.normal(size=(len(times), many))
    keep = np.exp(-np.diff(times) / seconds)
    for k, part in enumerate(keep, start=1):
        out[k] = part * out[k - 1] + np.sqrt(1 - part**2) * out[k]
    return out


def _path(kind: str, seconds: float, rng: np.random.Generator):
    knots = np.arange(0, seconds + 1)
    place = np.cumsum(rng.normal(size=(len(knots), 3)) * [0.15, 0.02, 0.15], axis=0)
    turns = rng.normal(size=(len(knots), 3)) * np.radians(
        {
            "all": [25, 40, 25],
            "yaw": [0, 55, 0],
            "shift": [0, 0, 0],
            "tiny": [1, 1, 1],
            "slow": [0, 8, 0],
        }[kind]
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
