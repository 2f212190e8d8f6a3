"""How a simulated phone errs."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class PhoneNoise:
    """Sizes of the errors; the defaults are those of a recent iPhone in an ordinary room."""

    jitter_m: float = 0.0004
    """Standard deviation of each pose's position error on each axis."""
    jitter_deg: float = 0.05
    """The same for the rotation."""
    drift: float = 0.005
    """Expected distance that the position has walked off at the end, as a part of the path."""
    skipped: float = 0.03
    """Chance that a pose is not saved, so that steps are 33 or 50 ms instead of 17."""
    focal_px: float = 8.0
    """How far autofocus moves the focal length."""
    centre_px: float = 4.0
    """How far stabilisation moves the principal point."""
    accel: float = 0.05
    """Standard deviation of the accelerometer, m/s^2."""
    gyro: float = 0.005
    """Standard deviation of the gyroscope, rad/s."""


NO_NOISE = PhoneNoise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""A perfect phone."""


def disturb(
    T_world_phone: Float64[np.ndarray, "frames 4 4"], noise: PhoneNoise, rng: np.random.Generator
) -> Float64[np.ndarray, "frames 4 4"]:
    """Poses with jitter on each and drift that grows along the path."""
    steps = np.linalg.norm(np.diff(T_world_phone[:, :3, 3], axis=0), axis=1)
    # A random walk over the path: its expected distance after the whole path is drift * path.
    size = noise.drift * np.sqrt(steps * steps.sum() * np.pi / 8)
    walk = np.cumsum(rng.normal(size=(len(steps), 3)) * size[:, None], axis=0)
    shift = np.concatenate([np.zeros((1, 3)), walk])
    shake = rng.normal(scale=noise.jitter_m, size=shift.shape)
    turn = rng.normal(scale=np.radians(noise.jitter_deg), size=shift.shape)
    out = T_world_phone.copy()
    out[:, :3, 3] += shift + shake
    out[:, :3, :3] = out[:, :3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    return out


def kept_frames(count: int, noise: PhoneNoise, rng: np.random.Generator) -> np.ndarray:
    """Indices of the poses that the app saves: never more than two in a row are skipped."""
    keep = rng.random(count) >= noise.skipped
    keep[[0, -1]] = True
    keep[2:] |= ~(keep[:-2] | keep[1:-1])
    return np.flatnonzero(keep)


def wobbling_intrinsics(
    times: Float64[np.ndarray, " frames"], noise: PhoneNoise, rng: np.random.Generator
) -> Float64[np.ndarray, "frames 4"]:
    """fx, fy, cx, cy of a 1920x1440 camera whose lens and sensor never stand quite still."""
    phase = rng.uniform(0, 2 * np.pi, size=3)
    rate = np.array([0.9, 2.3, 3.1])
    sway = np.sin(np.outer(times, rate) + phase)
    focal = 1460.0 + noise.focal_px * sway[:, 0]
    cx = 962.0 + noise.centre_px * sway[:, 1]
    cy = 718.0 + noise.centre_px * sway[:, 2]
    return np.stack([focal, focal, cx, cy], axis=1)
