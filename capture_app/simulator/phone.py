"""simulate: the session that Stray Scanner would have logged on a phone clamped to the object."""

from pathlib import Path

import numpy as np

from capture_app.simulator.noise import PhoneNoise, disturb, kept_frames, wobbling_intrinsics
from capture_app.simulator.path import PhonePath, phone_path
from ingest.formats import stray_scanner
from ingest.mount import Mount
from ingest.session import CaptureSession, ImuLog
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMotion

POSE_RATE = 60.0
IMU_RATE = 100.0
BOOT_SECONDS = 65575.5
"""The clock counts from when the phone was switched on; a session starts anywhere."""


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
