"""The session that Stray Scanner would have logged on a clamped phone, with the phone's errors."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ingest.axes import T_ZUP_ARKIT
from ingest.formats import stray_scanner
from ingest.mount import Mount
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog
from omomo_core.errors import InputError
from omomo_core.motion import FPS, ObjectMotion


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


POSE_RATE = 60.0
IMU_RATE = 100.0
BOOT_SECONDS = 65575.5
"""The clock counts from when the phone was switched on; a session starts anywhere."""


@dataclass(frozen=True)
class PhonePath:
    """The phone's camera over time, in the ARKit world of its session."""

    seconds: float
    position: CubicSpline
    rotation: RotationSpline

    def poses(self, times: Float64[np.ndarray, " frames"]) -> Float64[np.ndarray, "frames 4 4"]:
        """T_arkit_phone at times from the start of the motion."""
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3] = self.rotation(times).as_matrix()
        T[:, :3, 3] = self.position(times)
        return T

    def accelerometer(
        self, times: Float64[np.ndarray, " samples"]
    ) -> Float64[np.ndarray, "samples 3"]:
        """Return what Core Motion would report (m/s^2, device axes): gravity minus acceleration."""
        world = np.array([0.0, -GRAVITY, 0.0]) - self.position(times, 2)
        return self.rotation(times).inv().apply(world) @ R_CAMERA_DEVICE

    def gyroscope(self, times: Float64[np.ndarray, " samples"]) -> Float64[np.ndarray, "samples 3"]:
        """Angular velocity in device axes, rad/s."""
        return self.rotation(times, 1) @ R_CAMERA_DEVICE


def phone_path(motion: ObjectMotion, mount: Mount) -> PhonePath:
    """The path of a phone fixed to the object, passing exactly through its pose in every frame."""
    T_world_phone = motion.T_world_object @ np.linalg.inv(mount.T_phone_object)
    T = arkit_from_world(T_world_phone[0]) @ T_world_phone
    times = np.arange(len(T)) / FPS
    return PhonePath(
        seconds=float(times[-1]),
        position=CubicSpline(times, T[:, :3, 3]),
        rotation=RotationSpline(times, Rotation.from_matrix(T[:, :3, :3])),
    )


def arkit_from_world(
    T_world_phone: Float64[np.ndarray, "4 4"],
) -> Float64[np.ndarray, "4 4"]:
    """T_arkit_world: ARKit starts at the first camera, y up, -z along where the camera looks.

    A camera that looks straight up or down gives its heading by the top of its image.
    """
    forward = -T_world_phone[:3, 2]
    if np.hypot(forward[0], forward[1]) < 1e-3:
        forward = T_world_phone[:3, 1]
    yaw = np.arctan2(-forward[0], forward[1])  # turns world +y, which is ARKit's -z, into forward
    T_world_start = np.eye(4)
    T_world_start[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    T_world_start[:3, 3] = T_world_phone[:3, 3]
    return np.linalg.inv(T_world_start @ T_ZUP_ARKIT)


def simulate(
    motion: ObjectMotion, mount: Mount, *, seed: int, noise: PhoneNoise | None = None
) -> CaptureSession:
    """Return what a phone mounted on the object logs while the object makes this motion.

    The ARKit world starts at the first camera position with y up and -z along the camera's
    heading. The IMU is consistent with the motion; its lever arm to the camera (centimetres) is
    left out.

    Args:
        motion: the object over our floor, 30 fps; every frame counts, valid or not.
        mount: the object in the phone's frame.
        seed: the same seed gives the same session.
        noise: the phone's errors (default: those of a recent iPhone).

    Raises:
        InputError: "motion-short" for less than a second of motion.
    """
    path = phone_path(motion, mount)
    if path.seconds < 1.0:
        raise InputError(
            "motion-short",
            f"The motion lasts {path.seconds:.2f} s; a session needs at least one second.",
            fix="Give a longer motion.",
        )
    noise = PhoneNoise() if noise is None else noise
    rng = np.random.default_rng(seed)
    times = np.arange(int(path.seconds * POSE_RATE + 1e-6) + 1) / POSE_RATE
    T_world_phone = disturb(path.poses(times), noise, rng)
    kept = kept_frames(len(times), noise, rng)
    intrinsics = wobbling_intrinsics(times, noise, rng)
    stamps = BOOT_SECONDS + times[kept]
    return CaptureSession(
        app=stray_scanner.NAME,
        source=Path("simulated"),
        times=stamps,
        T_world_phone=T_world_phone[kept],
        intrinsics=intrinsics[kept],
        image_size=stray_scanner.IMAGE_SIZE,
        video_times=stamps,
        imu=_imu(path, noise, rng),
    )


def _imu(path: PhonePath, noise: PhoneNoise, rng: np.random.Generator) -> ImuLog:
    times = np.arange(int(path.seconds * IMU_RATE) + 1) / IMU_RATE
    accel = path.accelerometer(times)
    gyro = path.gyroscope(times)
    return ImuLog(
        times=BOOT_SECONDS + times,
        accel=accel + rng.normal(scale=noise.accel, size=accel.shape),
        gyro=gyro + rng.normal(scale=noise.gyro, size=gyro.shape),
    )
