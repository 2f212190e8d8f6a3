"""PhonePath: the smooth path of the phone through an object's motion, with its derivatives."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ingest.axes import T_ZUP_ARKIT
from ingest.mount import Mount
from ingest.session import GRAVITY, R_CAMERA_DEVICE
from omomo_core.motion import FPS, ObjectMotion


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
