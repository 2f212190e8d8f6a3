"""simulate: the session that Stray Scanner would have logged on a phone clamped to the object."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from capture_app.simulator.noise import PhoneNoise, disturb, kept_frames, wobbling_intrinsics
from ingest.axes import T_ZUP_ARKIT
from ingest.formats import stray_scanner
from ingest.mount import Mount
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog
from omomo_core.errors import InputError
from omomo_core.motion import FPS, ObjectMotion

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
        """What Core Motion would report (m/s^2, device axes): gravity minus acceleration."""
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
    """What a phone mounted on the object logs while the object makes this motion.

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
